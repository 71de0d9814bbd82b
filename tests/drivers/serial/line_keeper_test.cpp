// SPDX-License-Identifier: MIT
#include "drivers/serial/line_keeper.h"

#include <future>
#include <gmock/gmock.h>
#include <thread>

#include "scripted_line.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using namespace std::chrono_literals;

using OpenState = SerialLine::OpenState;

class LineKeeperTest : public testing::Test {
 protected:
  LineKeeperTest() {
    keeper_.onStateChange([this](SerialPortState state, const std::string& because) {
      reports_.push_back(std::string(toString(state)) + (because.empty() ? "" : ": " + because));
    });
  }
  // Waits until the time of the next attempt, as the port's thread does in poll().
  void waitForAttempt() { std::this_thread::sleep_for(keeper_.wakeAt().left()); }
  // Calls `act` and expects that it sets the time of the next attempt `pause` later.
  template <class Act>
  void expectPause(std::chrono::milliseconds pause, Act act) {
    const auto earliest = Clock::nowNs() + Nanoseconds(pause).count();
    act();
    const auto latest = Clock::nowNs() + Nanoseconds(pause).count();
    EXPECT_GE(keeper_.wakeAt().ns(), earliest) << pause.count() << " ms";
    EXPECT_LE(keeper_.wakeAt().ns(), latest) << pause.count() << " ms";
  }

  Watchdog watchdog_{"line keeper test"};
  LineScript script_{.waitsFor = {7, POLLIN, 0}};
  LineKeeper keeper_{std::make_unique<ScriptedLine>(script_)};
  std::vector<std::string> reports_;
};

TEST_F(LineKeeperTest, IsUnpluggedAndDueBeforeTheFirstAttempt) {
  EXPECT_EQ(keeper_.state(), SerialPortState::unplugged);
  EXPECT_EQ(keeper_.unpluggedBecause(), "not opened yet");
  EXPECT_EQ(keeper_.waitsFor().fd, -1);
  EXPECT_TRUE(keeper_.wakeAt().hasPassed());
  EXPECT_THAT(script_.calls, IsEmpty());
}

TEST_F(LineKeeperTest, OpensTheLineAndLeavesItOpen) {
  keeper_.service(0);
  keeper_.service(POLLIN);

  EXPECT_TRUE(keeper_.isOpen());
  EXPECT_EQ(keeper_.state(), SerialPortState::plugged);
  EXPECT_EQ(keeper_.unpluggedBecause(), "");
  EXPECT_EQ(keeper_.waitForFirstAttempt(), "");
  EXPECT_EQ(keeper_.waitsFor().fd, 7);
  EXPECT_TRUE(keeper_.wakeAt().isNever());
  EXPECT_THAT(script_.calls, ElementsAre("open"));
  EXPECT_THAT(reports_, ElementsAre("plugged"));
}

TEST_F(LineKeeperTest, ContinuesAnAttemptWhenTheLineIsReady) {
  script_.open = OpenState::opening;
  script_.openTimeout = 24h;
  expectPause(24h, [&] { keeper_.service(0); });
  EXPECT_EQ(keeper_.waitsFor().fd, 7);

  keeper_.service(0);
  EXPECT_EQ(script_.callsOf("open"), 1);
  keeper_.service(POLLOUT);
  EXPECT_EQ(script_.callsOf("open"), 2);
  EXPECT_FALSE(keeper_.isOpen());
  EXPECT_EQ(keeper_.unpluggedBecause(), "not opened yet");
  script_.open = OpenState::open;
  keeper_.service(POLLOUT);

  EXPECT_TRUE(keeper_.isOpen());
}

TEST_F(LineKeeperTest, EndsAnAttemptWithoutAnAnswerAtItsTimeout) {
  script_.open = OpenState::opening;
  keeper_.service(0);

  expectPause(20ms, [&] { keeper_.service(0); });

  EXPECT_THAT(script_.calls, ElementsAre("open", "close"));
  EXPECT_EQ(keeper_.waitsFor().fd, -1);
  EXPECT_EQ(keeper_.waitForFirstAttempt(), "scripted line: no answer within 0 ms");
  EXPECT_THAT(reports_, IsEmpty()) << "the line was unplugged before";
}

TEST_F(LineKeeperTest, DoublesThePauseBetweenAttemptsUpToOneSecond) {
  script_.open = OpenState::failed;
  for (const auto pause : {20ms, 40ms, 80ms, 160ms, 320ms, 640ms, 1000ms}) {
    script_.problem = "attempt before " + std::to_string(pause.count()) + " ms";
    waitForAttempt();
    expectPause(pause, [&] { keeper_.service(0); });
    EXPECT_EQ(keeper_.unpluggedBecause(), script_.problem);
  }
  keeper_.service(0);  // before its time
  EXPECT_EQ(script_.callsOf("open"), 7);
}

TEST_F(LineKeeperTest, KeepsThePauseOfALineThatWasOpenOnlyForAMoment) {
  script_.open = OpenState::failed;
  keeper_.service(0);
  waitForAttempt();
  script_.open = OpenState::open;
  const auto before = Clock::nowNs();
  keeper_.service(0);
  ASSERT_TRUE(keeper_.isOpen());

  keeper_.lose();

  const auto now = Clock::nowNs();
  const bool wasLong = now - before > Nanoseconds(1s).count();
  EXPECT_TRUE(keeper_.wakeAt().ns() >= before + Nanoseconds(40ms).count() || wasLong);
}

TEST_F(LineKeeperTest, BeginsWithAShortPauseAfterASecondInTheOpenState) {
  script_.open = OpenState::failed;
  keeper_.service(0);
  waitForAttempt();
  script_.open = OpenState::open;
  keeper_.service(0);
  const auto second = Deadline::after(1s + 1ms);
  while (!second.hasPassed()) std::this_thread::sleep_for(second.left());

  expectPause(20ms, [&] { keeper_.lose(); });
}

TEST_F(LineKeeperTest, ClosesALostLineAndReportsTheReason) {
  keeper_.service(0);
  script_.problem = "read tty: the device hung up";

  keeper_.lose();

  EXPECT_FALSE(keeper_.isOpen());
  EXPECT_THAT(script_.calls, ElementsAre("open", "close"));
  EXPECT_EQ(keeper_.unpluggedBecause(), "read tty: the device hung up");
  EXPECT_THAT(reports_, ElementsAre("plugged", "unplugged: read tty: the device hung up"));
  keeper_.onStateChange({});
  waitForAttempt();
  keeper_.service(0);
  EXPECT_TRUE(keeper_.isOpen());
  EXPECT_EQ(reports_.size(), 2U) << "no report without a handler";
}

TEST_F(LineKeeperTest, LetsOtherThreadsWaitForAState) {
  auto first = std::async(std::launch::async, [&] { return keeper_.waitForFirstAttempt(); });
  auto state = std::async(std::launch::async, [&] {
    return keeper_.waitForState(SerialPortState::plugged, Deadline::never());
  });
  EXPECT_FALSE(keeper_.waitForState(SerialPortState::plugged, Deadline::atNs(0)));

  keeper_.service(0);

  EXPECT_EQ(first.get(), "");
  EXPECT_TRUE(state.get());
  EXPECT_TRUE(keeper_.waitForState(SerialPortState::plugged, Deadline::atNs(0)));
}

}  // namespace
}  // namespace mpf::test
