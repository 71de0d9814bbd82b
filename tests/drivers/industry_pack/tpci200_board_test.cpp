// SPDX-License-Identifier: MIT
// The registers of the board in plain files, which keep what is written.
#include "drivers/industry_pack/tpci200_board.h"

#include <gmock/gmock.h>
#include <stdexcept>

#include "fake_pci.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

class Tpci200BoardTest : public testing::Test {
 protected:
  Tpci200BoardTest() { pci_.add(kAddress); }
  [[nodiscard]] PciDevice device() const {
    return {pci_.places(), {.name = "TPCI200", .vendor = 0x1498, .device = 0x30c8}, ""};
  }
  [[nodiscard]] unsigned boardRegister(std::size_t offset) const {
    return le16toh(pci_.get<std::uint16_t>(kAddress, "resource2", FakePci::kInPage + offset));
  }
  void setStatus(unsigned bits) const {
    pci_.set(kAddress, "resource2", FakePci::kInPage + kStatus,
             htole16(static_cast<std::uint16_t>(bits)));
  }
  // The I/O space of a site.
  static Tpci200Registers ioOf(Tpci200Board& board, const PciDevice& device, std::size_t site) {
    return {board, site,
            device.map(Tpci200Board::kSitesWindow, site * Tpci200Board::kSiteBytes,
                       Tpci200Board::kIoBytes)};
  }

  static constexpr const char* kAddress = "0000:03:00.0";
  static constexpr std::size_t kStatus = 0xc;
  FakePci pci_;
};

TEST_F(Tpci200BoardTest, ThatDoesNotAnswerIsRefused) {
  pci_.set(kAddress, "resource0", FakePci::kInPage + 0x2c, UINT32_MAX);

  EXPECT_THAT(
      [&] { const Tpci200Board board(device()); },
      ThrowsMessage<std::runtime_error>(HasSubstr("TPCI200 at 0000:03:00.0 does not answer")));
}

TEST_F(Tpci200BoardTest, WithoutAWindowIsRefused) {
  pci_.write(kAddress, "resource", "0x0 0x0 0x0\n");

  EXPECT_THAT([&] { const Tpci200Board board(device()); },
              ThrowsMessage<std::runtime_error>(HasSubstr("window 2 is too small")));
}

TEST_F(Tpci200BoardTest, SwapsTheBytesOfModulesOnly) {
  const auto descriptor = [&](std::size_t space) {
    return le32toh(pci_.get<std::uint32_t>(kAddress, "resource0", FakePci::kInPage + space));
  };
  pci_.set(kAddress, "resource0", FakePci::kInPage + 0x28, htole32(0xd54160a0));

  const Tpci200Board board(device());

  EXPECT_EQ(descriptor(0x28), 0xd44160a0U) << "all other bits are kept";
  EXPECT_EQ(descriptor(0x2c), 0x1000000U);
  EXPECT_EQ(descriptor(0x30), 0x1000000U);
  EXPECT_EQ(descriptor(0x34), 0U);
}

TEST_F(Tpci200BoardTest, PassesTheInterruptsOfTheGivenLines) {
  Tpci200Board board(device());

  board.setLines(0, 1);
  board.setLines(1, 2);
  board.setLines(3, 3);

  EXPECT_EQ(boardRegister(0x02), 0x40U);
  EXPECT_EQ(boardRegister(0x04), 0x80U);
  EXPECT_EQ(boardRegister(0x06), 0U);
  EXPECT_EQ(boardRegister(0x08), 0xc0U);
  board.setLines(3, 0);
  EXPECT_EQ(boardRegister(0x08), 0U);
}

TEST_F(Tpci200BoardTest, HasAStatusBitForEachLine) {
  Tpci200Board board(device());
  setStatus(0x1284);
  EXPECT_EQ(board.status(), 0x1284);
  EXPECT_EQ(Tpci200Board::statusBit(0, 0), 0x01);
  EXPECT_EQ(Tpci200Board::statusBit(1, 0), 0x04);
  EXPECT_EQ(Tpci200Board::statusBit(3, 1), 0x80);

  board.acknowledge(2, 1);

  EXPECT_EQ(boardRegister(kStatus), 0x20U) << "written to clear the line";
}

TEST_F(Tpci200BoardTest, ReadsOnesWhereACycleTimesOut) {
  const auto pci = device();
  Tpci200Board board(pci);
  auto a = ioOf(board, pci, 0);
  auto b = ioOf(board, pci, 1);
  setStatus(0x1000);  // of site A, as after each cycle
  EXPECT_EQ(a.read16(0), 0xffff);
  EXPECT_EQ(b.read16(0), 0);
  EXPECT_EQ(a.read32(4), 0xffffffff);
  setStatus(0x2000);
  EXPECT_EQ(b.read8(1), 0xff);
  EXPECT_EQ(a.read16(0), 0);
}

TEST_F(Tpci200BoardTest, ClearsOnlyTheTimeOutOfTheSite) {
  const auto pci = device();
  Tpci200Board board(pci);
  auto a = ioOf(board, pci, 0);
  setStatus(0x3003);

  a.write16(0, 0x1234);

  EXPECT_EQ(boardRegister(kStatus), 0x1000U) << "written to clear the time-out";
}

TEST_F(Tpci200BoardTest, AccessesModulesInTheByteOrderOfTheirBus) {
  const auto pci = device();
  Tpci200Board board(pci);
  auto b = ioOf(board, pci, 1);
  EXPECT_EQ(b.size(), Tpci200Board::kIoBytes);

  b.write32(0x10, 0x12345678);
  b.write8(0x21, 0xab);

  EXPECT_EQ(pci_.get<std::uint32_t>(kAddress, "resource3", FakePci::kInPage + 0x110),
            htobe32(0x12345678));
  EXPECT_EQ(b.read32(0x10), 0x12345678U);
  EXPECT_EQ(b.read16(0x12), 0x5678);
  EXPECT_EQ(b.read16(0x20), 0x00ab);
}

}  // namespace
}  // namespace mpf::test
