// SPDX-License-Identifier: MIT
#include "drivers/industry_pack/pci_device.h"

#include <gmock/gmock.h>
#include <stdexcept>

#include "fake_pci.h"

namespace mpf::test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

class PciDeviceTest : public testing::Test {
 protected:
  [[nodiscard]] PciDevice open(const std::string& which = "") const {
    return {pci_.places(), kind_, which};
  }
  void expectRefused(const std::string& which, const std::string& words) const {
    EXPECT_THAT([&] { static_cast<void>(open(which)); },
                ThrowsMessage<std::runtime_error>(HasSubstr(words)));
  }

  static int byteOf(const PciWindow& window, std::size_t offset) {
    return std::to_integer<int>(std::byte{window.data()[offset]});
  }

  static constexpr const char* kAddress = "0000:03:00.0";
  const PciKind kind_{.name = "TPCI200", .vendor = 0x1498, .device = 0x30c8};
  FakePci pci_;
};

TEST_F(PciDeviceTest, IsFoundByAddressNumberOrAsTheFirst) {
  pci_.add("0000:11:0a.0");
  pci_.add("0000:02:00.0", "0x8086", "0x100e");
  pci_.add("0000:03:00.0");

  EXPECT_EQ(open("0000:11:0a.0").address(), "0000:11:0a.0");
  EXPECT_EQ(open("11:0a.0").address(), "0000:11:0a.0");
  EXPECT_EQ(open("1").address(), "0000:11:0a.0");
  EXPECT_EQ(open("").address(), "0000:03:00.0");
  EXPECT_EQ(open("0").description(), "TPCI200 at 0000:03:00.0");
  EXPECT_THAT(findPciDevices(pci_.places(), kind_), ElementsAre("0000:03:00.0", "0000:11:0a.0"));
}

TEST_F(PciDeviceTest, ThatIsAbsentIsRefused) {
  EXPECT_THAT(findPciDevices(pci_.places(), kind_), IsEmpty()) << "a host without PCI";
  expectRefused("", "this host has no TPCI200 (PCI id 0x1498:0x30c8)");
  pci_.add(kAddress);
  pci_.add("0000:02:00.0", "0x8086", "0x100e");

  expectRefused("1", "this host has no TPCI200 number 1, counted from 0; its boards: 0000:03:00.0");
  expectRefused("18446744073709551616", "this host has no TPCI200 number 18446744073709551616,");
  expectRefused("04:00.0", "no PCI device at 04:00.0; boards of kind TPCI200: 0000:03:00.0");
  expectRefused("../devices/0000:03:00.0", "no PCI device at ../devices/0000:03:00.0");
  expectRefused("02:00.0",
                "the PCI device at 0000:02:00.0 is not a TPCI200: its id is 0x8086:0x100e");
}

TEST_F(PciDeviceTest, ThatIsBoundToAnotherDriverIsRefusedWithTheCommandsToRebindIt) {
  pci_.add(kAddress);
  pci_.setDriver(kAddress, "tpci200");

  EXPECT_THAT([&] { static_cast<void>(open()); },
              ThrowsMessage<std::runtime_error>(
                  AllOf(HasSubstr("the board is bound to the kernel's driver tpci200"),
                        HasSubstr("echo 0000:03:00.0 > " + pci_.file(kAddress, "driver/unbind")),
                        HasSubstr("modprobe uio_pci_generic; echo uio_pci_generic > " +
                                  pci_.file(kAddress, "driver_override")))));
}

TEST_F(PciDeviceTest, IsEnabled) {
  pci_.add(kAddress);
  pci_.write(kAddress, "enable", "0\n");

  static_cast<void>(open());

  EXPECT_EQ(pci_.get<char>(kAddress, "enable", 0), '1');
}

TEST_F(PciDeviceTest, MapsAPartOfAWindow) {
  pci_.add(kAddress);
  const auto device = open();
  pci_.set(kAddress, "resource3", FakePci::kInPage + 0x102, std::uint8_t{0x12});

  auto first = device.map(3, 0x100, 0x80);

  EXPECT_EQ(first.size(), 0x80U);
  EXPECT_EQ(byteOf(first, 2), 0x12);
  first.data()[3] = std::byte{0x34};
  EXPECT_EQ(pci_.get<std::uint8_t>(kAddress, "resource3", FakePci::kInPage + 0x103), 0x34);
  auto moved = std::move(first);
  EXPECT_EQ(byteOf(moved, 3), 0x34);
  moved = device.map(4, 0x1fff000, 0x1000);
  moved.data()[0xfff] = std::byte{0x56};
  EXPECT_EQ(pci_.get<std::uint8_t>(kAddress, "resource4", 0x1ffffff), 0x56);
}

TEST_F(PciDeviceTest, RefusesToMapBeyondAWindow) {
  pci_.add(kAddress);
  const auto device = open();
  EXPECT_EQ(device.map(2, 0x80, 0x80).size(), 0x80U);
  EXPECT_THAT(
      [&] { static_cast<void>(device.map(2, 0x82, 0x80)); },
      ThrowsMessage<std::runtime_error>(HasSubstr("window 2 is too small for 128 bytes at 0x82")));
  EXPECT_THROW(static_cast<void>(device.map(6, 0, 1)), std::runtime_error) << "no such window";
  std::filesystem::remove(pci_.file(kAddress, "resource3"));
  EXPECT_THAT(
      [&] { static_cast<void>(device.map(3, 0, 0x80)); },
      ThrowsMessage<std::runtime_error>(HasSubstr("resource3 cannot be opened: No such file")));
}

TEST_F(PciDeviceTest, WithoutPermissionIsRefusedWithTheNameOfTheFile) {
  pci_.add(kAddress);
  const auto device = open();
  std::filesystem::permissions(pci_.file(kAddress, "resource2"), std::filesystem::perms::none);
  const NoRoot noRoot;

  EXPECT_THAT([&] { static_cast<void>(device.open("resource2")); },
              ThrowsMessage<std::runtime_error>(AllOf(
                  HasSubstr("no permission to read and write " + pci_.file(kAddress, "resource2")),
                  HasSubstr("chgrp GROUP"))));
}

TEST_F(PciDeviceTest, HasAnInterruptFileOnlyWithItsDriver) {
  pci_.add(kAddress);
  EXPECT_EQ(open().interruptFile(), "");
  EXPECT_THAT(open().howToGetInterrupts(),
              HasSubstr("modprobe uio_pci_generic; echo uio_pci_generic > "));

  pci_.giveInterrupt(kAddress);

  EXPECT_EQ(open().interruptFile(), pci_.places().dev + "/uio7");
}

}  // namespace
}  // namespace mpf::test
