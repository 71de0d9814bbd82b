// SPDX-License-Identifier: MIT
#include "drivers/industry_pack/pci_interrupt.h"

#include <poll.h>

#include <gmock/gmock.h>
#include <system_error>

#include "fake_pci.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

class PciInterruptTest : public testing::Test {
 protected:
  PciInterruptTest() { pci_.add(kAddress); }
  [[nodiscard]] PciDevice device() const {
    return {pci_.places(), {.name = "TPCI200", .vendor = 0x1498, .device = 0x30c8}, ""};
  }
  // The command register of the board: 16 bits, little-endian.
  [[nodiscard]] unsigned command() const {
    return le16toh(pci_.get<std::uint16_t>(kAddress, "config", 4));
  }
  static bool isReadable(const PciInterrupt& interrupt) {
    pollfd readable{interrupt.descriptor(), POLLIN, 0};
    return ::poll(&readable, 1, 0) == 1;
  }

  static constexpr const char* kAddress = "0000:03:00.0";
  FakePci pci_;
};

TEST_F(PciInterruptTest, UnmasksAnInterruptThatAKilledProcessLeftMasked) {
  pci_.giveInterrupt(kAddress);
  pci_.set(kAddress, "config", 4, htole16(0x0507));

  PciInterrupt interrupt(device());

  EXPECT_EQ(interrupt.name(), pci_.places().dev + "/uio7");
  EXPECT_EQ(command(), 0x0107U) << "all other bits are kept";
  pci_.set(kAddress, "config", 4, htole16(0x0407));
  interrupt.unmask();
  EXPECT_EQ(command(), 0x0007U);
}

TEST_F(PciInterruptTest, IsTakenOnceWithoutWaiting) {
  pci_.giveInterrupt(kAddress);
  PciInterrupt interrupt(device());
  EXPECT_FALSE(isReadable(interrupt));
  EXPECT_FALSE(interrupt.tryTake());

  pci_.interrupt();

  EXPECT_TRUE(isReadable(interrupt));
  EXPECT_TRUE(interrupt.tryTake());
  EXPECT_FALSE(interrupt.tryTake());
}

TEST_F(PciInterruptTest, FailsWhenTheBoardIsUnboundFromItsDriver) {
  pci_.giveInterrupt(kAddress);
  PciInterrupt interrupt(device());

  pci_.takeInterruptAway();

  EXPECT_THAT([&] { static_cast<void>(interrupt.tryTake()); },
              ThrowsMessage<std::system_error>(HasSubstr("/uio7")));
}

TEST_F(PciInterruptTest, OfABoardWithoutItsDriverIsRefusedWithTheCommands) {
  EXPECT_THAT([&] { const PciInterrupt interrupt(device()); },
              ThrowsMessage<std::runtime_error>(
                  HasSubstr("the board is not bound to uio_pci_generic; as root: modprobe")));
}

TEST_F(PciInterruptTest, WithoutPermissionIsRefusedWithTheNameOfTheFile) {
  pci_.giveInterrupt(kAddress);
  const auto board = device();
  std::filesystem::permissions(pci_.places().dev + "/uio7", std::filesystem::perms::none);
  const NoRoot noRoot;

  EXPECT_THAT([&] { const PciInterrupt interrupt(board); },
              ThrowsMessage<std::runtime_error>(
                  HasSubstr("/dev/uio7 cannot be opened (Permission denied)")));
}

}  // namespace
}  // namespace mpf::test
