// SPDX-License-Identifier: MIT
#include "drivers/ti9914/ti9914_chip.h"

#include <atomic>
#include <future>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <optional>

#include <mpf/drivers/industry_pack/industry_pack_error.h>

#include "tests/drivers/ti9914/ti9914_fixture.h"

namespace mpf::test {
namespace {

using Chip = Ti9914Chip;
using testing::HasSubstr;

class Ti9914ChipTest : public Ti9914Test {
 protected:
  Chip& startChip(const Chip::Options& options = {.vector = 104}) {
    auto& module = modules_.create("a-ip488", "ipac", "IP_a", kIp488);
    chip_.emplace(module, options, [this] {
      ++served_;
      served_.notify_all();
    });
    EXPECT_EQ(chip_->setUp(), "");
    return *chip_;
  }
  [[nodiscard]] bool isActive(gpib_line::Line line) const { return bus_->lines().has(line); }

  void waitForServed(int count) {
    for (int seen = served_; seen < count; seen = served_) served_.wait(seen);
  }

  std::atomic<int> served_{0};  // calls for service
  std::optional<Chip> chip_;
};

TEST_F(Ti9914ChipTest, IsInChargeAfterSetUp) {
  auto& chip = startChip();

  EXPECT_FALSE(chip.isLost());
  EXPECT_EQ(chip.lines() & ~(gpib_line::kNdac), gpib_line::kAtn | gpib_line::kRen);
  EXPECT_EQ(model_->vector(), 105) << "the vector must be odd";
  EXPECT_EQ(chip.waitFor(Chip::kCanSend, Deadline::never()), Chip::kCanSend);
}

TEST_F(Ti9914ChipTest, RefusesAnInvalidVector) {
  auto& module = modules_.create("a-ip488", "ipac", "IP_a", kIp488);
  EXPECT_THROW(chip_.emplace(module, Chip::Options{.vector = 256}, [] {}), IndustryPackError);
}

TEST_F(Ti9914ChipTest, KeepsEventsUntilTheyAreUsed) {
  auto& chip = startChip();

  EXPECT_EQ(chip.poll(Chip::kCanSend), Chip::kCanSend);
  EXPECT_EQ(chip.poll(Chip::kCanSend), Chip::kCanSend);
  chip.forget(Chip::kCanSend);
  EXPECT_EQ(chip.poll(Chip::kCanSend), 0U);
  chip.write('?');
  EXPECT_EQ(chip.poll(Chip::kCanSend), Chip::kCanSend);
}

TEST_F(Ti9914ChipTest, ReturnsWithoutTheEventAtTheDeadline) {
  auto& chip = startChip();
  const auto deadline = soon();

  EXPECT_EQ(chip.waitFor(Chip::kHasByte, deadline) & Chip::kHasByte, 0U);

  EXPECT_TRUE(deadline.hasPassed());
}

// Polls only once a century, so that only an interrupt can wake it.
TEST_F(Ti9914ChipTest, SleepsUntilAnInterrupt) {
  const std::chrono::hours century(876'000);
  auto& chip = startChip({.vector = 104, .pollEvery = century, .idlePollEvery = {}});
  chip.forget(Chip::kCanSend);
  bus_->setFault({.kind = GpibFault::Kind::stuckActive, .lines = gpib_line::kNdac});
  chip.write('?');
  auto waiting = std::async(std::launch::async,
                            [&] { return chip.waitFor(Chip::kCanSend, Deadline::never()); });

  EXPECT_EQ(waiting.wait_for(std::chrono::milliseconds(20)), std::future_status::timeout);
  bus_->heal();

  EXPECT_EQ(waiting.get(), Chip::kCanSend);
}

TEST_F(Ti9914ChipTest, CallsForServiceFromAThreadOfItsOwn) {
  startChip();

  bus_->access([&](const GpibLines& /*lines*/) { memory_->requestService(0); });

  waitForServed(1);
}

TEST_F(Ti9914ChipTest, CallsForServiceAlsoWhenTheCallerSawTheRequestFirst) {
  auto& chip = startChip({.vector = 104, .idlePollEvery = {}});
  chip.forget(Chip::kCanSend);
  carrier_.setFault("IP_a", ModelFault::interruptsLost);
  bus_->access([&](const GpibLines& /*lines*/) { memory_->requestService(0); });

  chip.forget(0);

  waitForServed(1);
}

// A service request that the caller sees first leaves an interrupt without an event behind.
TEST_F(Ti9914ChipTest, DoesNotTakeManyServiceRequestsForAStuckLine) {
  std::atomic<int> alarms{0};
  auto& chip =
      startChip({.vector = 104, .onAlarm = [&](const std::string& /*what*/) { ++alarms; }});
  chip.forget(Chip::kCanSend);

  for (int i = 0; i < 5000; ++i) {
    bus_->access([&](const GpibLines& /*lines*/) { memory_->requestService(0); });
    chip.forget(0);
    bus_->access([&](const GpibLines& /*lines*/) { memory_->serialPoll(); });
    waitForServed(i + 1);
  }

  EXPECT_EQ(alarms, 0);
}

TEST_F(Ti9914ChipTest, ReportsAnInterruptLineThatIsStuck) {
  std::promise<std::string> alarm;
  startChip({.vector = 104, .onAlarm = [&](const std::string& what) { alarm.set_value(what); }});

  carrier_.setFault("IP_a", ModelFault::interruptStorm);

  EXPECT_THAT(alarm.get_future().get(), HasSubstr("module \"a-ip488\" (carrier ipac, site IP_a): "
                                                  "the interrupt line is stuck active"));
}

TEST_F(Ti9914ChipTest, WritesAStateOnlyWhenItChanges) {
  auto& chip = startChip();
  chip.setState(ti9914::kSre, false);
  EXPECT_FALSE(isActive(gpib_line::kRen));
  chip.command(ti9914::kSre, true);

  chip.setState(ti9914::kSre, false);

  EXPECT_TRUE(isActive(gpib_line::kRen)) << "nothing was written";
  EXPECT_EQ(model_->lostCommands(), 0U);
}

TEST_F(Ti9914ChipTest, KeepsRemoteEnableOverASetUp) {
  auto& chip = startChip();
  chip.setState(ti9914::kSre, false);
  EXPECT_EQ(chip.setUp(), "");
  EXPECT_FALSE(isActive(gpib_line::kRen));
}

TEST_F(Ti9914ChipTest, IsLostWhenTheModuleDoesNotAnswer) {
  auto& chip = startChip();
  chip.forget(Chip::kCanSend);
  carrier_.setFault("IP_a", ModelFault::busError);

  EXPECT_EQ(chip.waitFor(Chip::kCanSend, Deadline::never()), Chip::kLost);
  EXPECT_TRUE(chip.isLost());
  EXPECT_THAT(chip.setUp(), HasSubstr("IP_a"));
  EXPECT_TRUE(chip.isLost());

  carrier_.setFault("IP_a", ModelFault::none);
  EXPECT_EQ(chip.setUp(), "");
  EXPECT_FALSE(chip.isLost());
}

TEST_F(Ti9914ChipTest, ReleasesTheBusAtItsEnd) {
  startChip();

  chip_.reset();

  EXPECT_EQ(bus_->lines().control, 0);
}

}  // namespace
}  // namespace mpf::test
