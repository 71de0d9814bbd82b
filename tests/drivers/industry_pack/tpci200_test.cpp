// SPDX-License-Identifier: MIT
// The carrier with files in place of a board: selection of a board, error messages, windows,
// interrupts. tests/tpci200 runs it on QEMU's model of the board.
#include "drivers/industry_pack/tpci200.h"

#include <poll.h>

#include <gmock/gmock.h>
#include <semaphore>

#include <mpf/drivers/industry_pack/industry_pack_error.h>
#include <mpf/drivers/industry_pack/interrupt_thread.h>

#include "fake_pci.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;

constexpr const char* kBoard = "0000:03:00.0";
constexpr std::size_t kInPage = FakePci::kInPage;

class Tpci200Test : public testing::Test {
 protected:
  [[nodiscard]] Tpci200Options options(const std::string& board = "") const {
    Tpci200Options options;
    options.board = board;
    options.places = pci_.places();
    return options;
  }
  [[nodiscard]] std::uint16_t control(int site) const {
    return le16toh(pci_.get<std::uint16_t>(kBoard, "resource2",
                                           kInPage + 2 + 2 * static_cast<std::size_t>(site)));
  }
  void setControl(int site, std::uint16_t value) const {
    pci_.set(kBoard, "resource2", kInPage + 2 + 2 * static_cast<std::size_t>(site), htole16(value));
  }
  void setStatus(unsigned bits) const {
    pci_.set(kBoard, "resource2", kInPage + 0xc, htole16(static_cast<std::uint16_t>(bits)));
  }
  [[nodiscard]] bool isInterruptMasked() const {
    return (pci_.get<std::uint8_t>(kBoard, "config", 5) & 4) != 0;
  }
  static void waitFor(const Interrupt& interrupt) {
    pollfd readable{.fd = interrupt.descriptor(), .events = POLLIN, .revents = 0};
    ASSERT_EQ(::poll(&readable, 1, -1), 1);
  }

  Watchdog watchdog_{"TPCI200 test"};
  FakePci pci_;
};

TEST_F(Tpci200Test, IsFoundByAddressNumberOrAsTheFirst) {
  pci_.add("0000:03:00.0");
  pci_.add("0000:02:00.0", "0x8086", "0x100e");
  pci_.add("0000:11:0a.0");
  EXPECT_EQ(Tpci200(options("0000:11:0a.0")).description(), "TPCI200 at 0000:11:0a.0");
  EXPECT_EQ(Tpci200(options("11:0a.0")).description(), "TPCI200 at 0000:11:0a.0");
  EXPECT_EQ(Tpci200(options("1")).description(), "TPCI200 at 0000:11:0a.0");
  EXPECT_EQ(Tpci200(options("")).description(), "TPCI200 at 0000:03:00.0");
}

TEST_F(Tpci200Test, WithoutPermissionForTheInterruptPollsAndNamesTheFile) {
  pci_.add(kBoard);
  pci_.giveInterrupt(kBoard);
  std::filesystem::permissions(pci_.places().dev + "/uio7", std::filesystem::perms::none);
  for (const auto* const used : {"resource0", "resource2", "resource3"})
    std::filesystem::permissions(pci_.file(kBoard, used), std::filesystem::perms::all);
  const NoRoot noRoot;
  const Tpci200 carrier(options());
  EXPECT_THAT(carrier.remark(), HasSubstr("its interrupts are polled"));
  EXPECT_THAT(carrier.remark(), HasSubstr("/dev/uio7 cannot be opened (Permission denied)"));
}

TEST_F(Tpci200Test, HasTheSpacesOfEachSiteAtTheirAddresses) {
  pci_.add(kBoard);
  Tpci200 carrier(options());
  ASSERT_EQ(carrier.siteCount(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    auto& site = carrier.site(i);
    EXPECT_EQ(site.io().size(), 0x80U);
    EXPECT_EQ(site.id().size(), 0x40U);
    EXPECT_EQ(site.memory().size(), 8U << 20);
    site.io().write16(0x10, 0x1234);
    site.io().write8(0x21, 0x56);
    site.memory().write16(0x7ffffe, static_cast<std::uint16_t>(0xaa00 + i));
    EXPECT_EQ(pci_.get<std::uint16_t>(kBoard, "resource3", kInPage + 0x100 * i + 0x10),
              htobe16(0x1234));
    EXPECT_EQ(pci_.get<std::uint8_t>(kBoard, "resource3", kInPage + 0x100 * i + 0x21), 0x56);
    EXPECT_EQ(pci_.get<std::uint16_t>(kBoard, "resource4", 0x800000 * (i + 1) - 2),
              htobe16(static_cast<std::uint16_t>(0xaa00 + i)));
    pci_.set(kBoard, "resource3", kInPage + 0x100 * i + 0x80, htobe32(0x00490050));
    EXPECT_EQ(site.id().read32(0), 0x00490050U);
    EXPECT_EQ(site.id().read8(3), 0x50);
  }
  EXPECT_THROW(static_cast<void>(carrier.site(4)), std::out_of_range);
}

TEST_F(Tpci200Test, GivesASiteToOneProcessAtATime) {
  pci_.add(kBoard);
  Tpci200 first(options());
  Tpci200 second(options());
  static_cast<void>(first.site(0));
  static_cast<void>(second.site(1));
  EXPECT_THROW(static_cast<void>(second.site(0)), std::runtime_error);
  static_cast<void>(first.site(0));
}

TEST_F(Tpci200Test, MasksInterruptsThatAKilledProcessLeftEnabled) {
  pci_.add(kBoard);
  setControl(2, 0xc0);
  setControl(3, 0xc0);
  Tpci200 carrier(options());
  EXPECT_EQ(control(2), 0xc0);
  static_cast<void>(carrier.site(2));
  EXPECT_EQ(control(2), 0);
  EXPECT_EQ(control(3), 0xc0);
}

TEST_F(Tpci200Test, PassesEachInterruptOnce) {
  pci_.add(kBoard);
  pci_.giveInterrupt(kBoard);
  Tpci200 carrier(options());
  EXPECT_EQ(carrier.remark(), "");
  EXPECT_FALSE(isInterruptMasked());
  auto& line = carrier.site(1).interrupt(1);
  line.enable();
  EXPECT_EQ(control(1), 0x80);
  for (int i = 0; i < 3; ++i) {
    pci_.set<std::uint8_t>(kBoard, "config", 5, 4);  // as the kernel does
    setStatus(0x8);
    pci_.interrupt();
    waitFor(line);
    EXPECT_EQ(line.take(), 1U);
    EXPECT_EQ(control(1), 0);
    while (isInterruptMasked()) std::this_thread::yield();
    line.enable();
    EXPECT_EQ(control(1), 0x80);
  }
}

TEST_F(Tpci200Test, PassesNoInterruptThatIsNotEnabled) {
  pci_.add(kBoard);
  pci_.giveInterrupt(kBoard);
  Tpci200 carrier(options());
  auto& wanted = carrier.site(0).interrupt(1);
  auto& other = carrier.site(0).interrupt(0);  // served first
  other.enable();
  other.disable();
  wanted.enable();
  EXPECT_EQ(control(0), 0x80);
  setStatus(0x3);
  pci_.interrupt();
  waitFor(wanted);
  EXPECT_EQ(other.take(), 0U);
}

TEST_F(Tpci200Test, MasksASiteWithoutAProcessButNotThatOfAnotherProcess) {
  pci_.add(kBoard);
  pci_.giveInterrupt(kBoard);
  Tpci200 another(options());
  static_cast<void>(another.site(2));
  Tpci200 carrier(options());
  auto& line = carrier.site(0).interrupt(0);
  line.enable();
  setControl(2, 0x40);
  setControl(3, 0x40);
  setStatus(0x51);  // lines of sites A, C and D
  pci_.interrupt();
  waitFor(line);
  while (control(3) != 0) std::this_thread::yield();
  EXPECT_EQ(control(2), 0x40);
}

TEST_F(Tpci200Test, MasksItsLinesAtTheEnd) {
  pci_.add(kBoard);
  {
    Tpci200 carrier(options());
    carrier.site(0).interrupt(0).enable();
    EXPECT_EQ(control(0), 0x40);
  }
  EXPECT_EQ(control(0), 0);
}

TEST_F(Tpci200Test, PollsWithoutPciInterrupts) {
  pci_.add(kBoard);
  Tpci200 carrier(options());
  EXPECT_THAT(carrier.remark(), HasSubstr("its interrupts are polled, every 1000 us"));
  EXPECT_THAT(carrier.remark(), HasSubstr("modprobe uio_pci_generic"));
  auto& line = carrier.site(3).interrupt(0);
  setStatus(0x40);
  line.enable();
  waitFor(line);
  EXPECT_EQ(line.take(), 1U);
  EXPECT_EQ(control(3), 0);
  setStatus(0);
  line.enable();
  setStatus(0x40);
  waitFor(line);
}

TEST_F(Tpci200Test, PollsWhenTheBoardIsUnboundFromItsDriver) {
  pci_.add(kBoard);
  pci_.giveInterrupt(kBoard);
  Tpci200 carrier(options());
  auto& line = carrier.site(0).interrupt(0);
  line.enable();
  setStatus(0x1);
  pci_.takeInterruptAway();
  waitFor(line);
  EXPECT_TRUE(line.isPolled());
}

TEST_F(Tpci200Test, ReportsALineThatIsPolledLater) {
  pci_.add(kBoard);
  pci_.giveInterrupt(kBoard);
  Tpci200 carrier(options());
  std::binary_semaphore isPolled(0);
  InterruptThread thread(
      carrier.site(0).interrupt(0), {.pollEvery = std::chrono::milliseconds(1)},
      [](InterruptThread::Cause) { return false; },
      [&](InterruptFault fault) {
        EXPECT_EQ(fault, InterruptFault::polled);
        isPolled.release();
      });

  pci_.takeInterruptAway();

  isPolled.acquire();
}

TEST(Tpci200ParametersTest, AreAnAddressAndAPollingPeriod) {
  EXPECT_EQ(Tpci200Options::parse("").board, "");
  EXPECT_EQ(Tpci200Options::parse("0000:03:00.0").board, "0000:03:00.0");
  const auto both = Tpci200Options::parse("1,poll=250");
  EXPECT_EQ(both.board, "1");
  EXPECT_EQ(both.pollEvery, std::chrono::microseconds(250));
  for (const auto* const wrong :
       {"eth0", "../0000:03:00.0", "0,fast", "0,poll=", "0,poll=0", "0,poll=5ms", "0,poll=2000000"})
    EXPECT_THROW(static_cast<void>(Tpci200Options::parse(wrong)), IndustryPackError) << wrong;
}

}  // namespace
}  // namespace mpf::test
