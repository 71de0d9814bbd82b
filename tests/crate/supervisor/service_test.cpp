// SPDX-License-Identifier: MIT
// Service: what it does after each event, without processes and without real time.
#include "crate/supervisor/service.h"

#include <signal.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace mpf::crate::test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

constexpr ProcessEnd exited(int status) { return {status << 8}; }
constexpr ProcessEnd killedBy(int signal) { return {signal}; }

class ServiceTest : public testing::Test {
 protected:
  static ProcessPlan planOf() {
    ProcessPlan plan;
    plan.name = "dac";
    plan.startTime = 5s;
    plan.stopTime = 2s;
    plan.stallLimit = 10s;
    plan.busyLimit = 5s;
    plan.firstPause = 100ms;
    plan.lastPause = 300ms;
    plan.maxRestarts = 3;
    plan.restartWindow = 60s;
    return plan;
  }
  Action action(bool areNeedsReady = true) { return service_.action(areNeedsReady, now_); }
  void pass(std::chrono::nanoseconds time) { now_ += time.count(); }
  void start() {
    ASSERT_EQ(action(), Action::start);
    service_.started(100, 7, now_);
  }
  void becomeReady() {
    start();
    service_.becameReady();
  }
  void end(const ProcessEnd& end) { service_.ended(end, now_); }
  static Work work(std::chrono::nanoseconds time) { return {"psu", {2, 7}, time.count()}; }

  std::int64_t now_ = 1'000'000'000;
  Service service_{planOf()};
};

TEST_F(ServiceTest, StartsWhenItsNeedsAreReady) {
  EXPECT_EQ(action(false), Action::none);
  EXPECT_EQ(service_.state(), ServiceState::waiting);

  EXPECT_EQ(action(true), Action::start);

  service_.started(100, 7, now_);
  EXPECT_EQ(service_.state(), ServiceState::starting);
  service_.becameReady();
  EXPECT_EQ(service_.state(), ServiceState::ready);
  EXPECT_EQ(action(), Action::none);
  EXPECT_EQ(service_.nextActionNs(), std::nullopt);
}

// A server whose device is absent must not delay the start of the crate for ever.
TEST_F(ServiceTest, IsSettledWhenItIsReadyOrHasFailedOnce) {
  start();
  EXPECT_FALSE(service_.isSettled());
  service_.becameReady();
  EXPECT_TRUE(service_.isSettled());
  service_.requestRestart(now_);
  EXPECT_FALSE(service_.isSettled());
  end(exited(0));
  start();
  EXPECT_FALSE(service_.isSettled());

  end(exited(1));

  EXPECT_TRUE(service_.isSettled());
  pass(1s);
  start();
  EXPECT_TRUE(service_.isSettled()) << "starting again";
}

TEST_F(ServiceTest, RestartsWithPausesThatGrow) {
  for (const auto pause : {100ms, 200ms, 300ms}) {
    becomeReady();
    end(killedBy(SIGSEGV));
    EXPECT_EQ(service_.state(), ServiceState::pausing);
    EXPECT_EQ(service_.nextActionNs(), now_ + std::chrono::nanoseconds(pause).count());
    pass(pause - 1ns);
    EXPECT_EQ(action(), Action::none);
    pass(1ns);
  }
  EXPECT_EQ(service_.restarts(), 3);
  EXPECT_EQ(service_.reason(), "SIGSEGV");
}

TEST_F(ServiceTest, FailsAfterTooManyRestarts) {
  for (int i = 0; i < 3; ++i) {
    becomeReady();
    end(exited(1));
    pass(1s);
  }
  becomeReady();
  end(exited(1));

  EXPECT_EQ(service_.state(), ServiceState::failed);
  EXPECT_THAT(service_.reason(), HasSubstr("exit status 1; it ended 4 times within 60"));
  pass(1h);
  EXPECT_EQ(action(), Action::none);
  service_.requestStart();
  EXPECT_EQ(action(), Action::start);
}

TEST_F(ServiceTest, RestartsOfLongAgoDoNotCount) {
  for (int i = 0; i < 20; ++i) {
    becomeReady();
    end(exited(1));
    pass(61s);
  }
  EXPECT_EQ(service_.state(), ServiceState::pausing);
}

TEST_F(ServiceTest, WrongArgumentsAreNotTriedAgain) {
  start();
  end(exited(2));

  EXPECT_EQ(service_.state(), ServiceState::failed);
}

TEST_F(ServiceTest, TheRestartPolicyDecides) {
  struct Case {
    Restart restart;
    ProcessEnd end;
    ServiceState state;
  };
  for (const auto& [restart, end, state] :
       {Case{Restart::always, exited(0), ServiceState::pausing},
        Case{Restart::onFailure, exited(0), ServiceState::stopped},
        Case{Restart::onFailure, exited(1), ServiceState::pausing},
        Case{Restart::onFailure, killedBy(SIGKILL), ServiceState::pausing},
        Case{Restart::never, exited(0), ServiceState::stopped},
        Case{Restart::never, killedBy(SIGKILL), ServiceState::stopped}}) {
    auto plan = planOf();
    plan.restart = restart;
    Service service(plan);
    ASSERT_EQ(service.action(true, now_), Action::start);
    service.started(1, 1, now_);
    service.ended(end, now_);
    EXPECT_EQ(service.state(), state) << end.text();
  }
}

TEST_F(ServiceTest, IsStoppedWithSigtermThenSigkill) {
  becomeReady();

  service_.requestStop(now_);

  EXPECT_EQ(action(), Action::terminate);
  EXPECT_EQ(action(), Action::none);
  EXPECT_EQ(service_.nextActionNs(), now_ + 2'000'000'000);
  pass(2s);
  EXPECT_EQ(action(), Action::kill);
  EXPECT_EQ(action(), Action::none);
  end(killedBy(SIGKILL));
  EXPECT_EQ(service_.state(), ServiceState::stopped);
  EXPECT_FALSE(service_.isRunning());
  pass(1h);
  EXPECT_EQ(action(), Action::none);
}

TEST_F(ServiceTest, AStopEndsAnyState) {
  service_.requestStop(now_);
  EXPECT_EQ(service_.state(), ServiceState::stopped);
  service_.requestStart();
  start();
  end(exited(1));
  ASSERT_EQ(service_.state(), ServiceState::pausing);

  service_.requestStop(now_);

  EXPECT_EQ(service_.state(), ServiceState::stopped);
}

TEST_F(ServiceTest, ARestartHasNoPause) {
  becomeReady();
  service_.requestRestart(now_);
  ASSERT_EQ(action(), Action::terminate);

  end(exited(0));

  EXPECT_EQ(action(), Action::start);
  EXPECT_EQ(service_.restarts(), 1);
  EXPECT_EQ(service_.reason(), "restarted by request");
}

TEST_F(ServiceTest, AStartDuringAStopStartsAgain) {
  becomeReady();
  service_.requestStop(now_);
  ASSERT_EQ(action(), Action::terminate);
  service_.requestStart();

  end(exited(0));

  EXPECT_EQ(action(), Action::start);
}

TEST_F(ServiceTest, AStartDuringARestartDoesNotChangeIt) {
  becomeReady();
  service_.requestRestart(now_);
  ASSERT_EQ(action(), Action::terminate);
  service_.requestStart();

  end(exited(2));

  EXPECT_EQ(action(), Action::start);
  EXPECT_EQ(service_.reason(), "restarted by request");
}

TEST_F(ServiceTest, IsRestartedWhenItDoesNotBecomeReady) {
  start();
  pass(5s);

  EXPECT_EQ(action(), Action::terminate);

  end(killedBy(SIGTERM));
  EXPECT_EQ(service_.state(), ServiceState::pausing);
  EXPECT_THAT(service_.reason(), HasSubstr("not ready within 5"));
}

TEST_F(ServiceTest, IsKilledWhenItIsStalledForTooLong) {
  becomeReady();
  service_.looked(true, {}, now_);
  EXPECT_TRUE(service_.isStalled());
  pass(9s);
  service_.looked(true, {}, now_);
  EXPECT_EQ(action(), Action::none);
  pass(1s);

  EXPECT_EQ(action(), Action::kill);

  end(killedBy(SIGKILL));
  EXPECT_EQ(service_.state(), ServiceState::pausing);
  EXPECT_THAT(service_.reason(), HasSubstr("stalled for 10"));
}

TEST_F(ServiceTest, IsNotRestartedAgainstThePolicyWhenItIsStalledOrNotReady) {
  auto plan = planOf();
  plan.restart = Restart::never;
  for (const bool isReady : {false, true}) {
    Service service(plan);
    ASSERT_EQ(service.action(true, now_), Action::start);
    service.started(1, 1, now_);
    if (isReady) service.becameReady();
    service.looked(isReady, {}, now_);
    pass(10s);
    ASSERT_NE(service.action(true, now_), Action::none);
    service.ended(killedBy(SIGKILL), now_);
    EXPECT_EQ(service.state(), ServiceState::failed);
    EXPECT_THAT(service.reason(), HasSubstr(isReady ? "stalled for 10" : "not ready within 5"));
  }
}

TEST_F(ServiceTest, AStallThatEndsIsForgotten) {
  becomeReady();
  service_.looked(true, {}, now_);
  pass(9s);
  service_.looked(false, {}, now_);
  pass(5s);
  service_.looked(true, {}, now_);
  pass(9s);

  EXPECT_EQ(action(), Action::none);
}

TEST_F(ServiceTest, WithoutALimitAStalledServerContinues) {
  auto plan = planOf();
  plan.stallLimit = 0ms;
  Service service(plan);
  ASSERT_EQ(service.action(true, now_), Action::start);
  service.started(1, 1, now_);
  service.becameReady();
  service.looked(true, {}, now_);
  pass(24h);

  EXPECT_EQ(service.action(true, now_), Action::none);
}

TEST_F(ServiceTest, IsKilledWhenItIsBusyWithOneRequestForTooLong) {
  becomeReady();
  service_.looked(false, work(4999ms), now_);
  EXPECT_EQ(action(), Action::none);
  pass(1h);
  EXPECT_EQ(action(), Action::none) << "the request may have ended since the look";

  service_.looked(false, work(5s), now_);

  EXPECT_EQ(service_.endReason(), EndReason::busy);
  EXPECT_EQ(action(), Action::kill);
  end(killedBy(SIGKILL));
  EXPECT_EQ(service_.state(), ServiceState::pausing);
  EXPECT_EQ(service_.reason(), "busy with int32 cmd=7 for 5.0 s");
}

TEST_F(ServiceTest, WithoutALimitABusyServerContinues) {
  auto plan = planOf();
  plan.busyLimit = 0ms;
  Service service(plan);
  ASSERT_EQ(service.action(true, now_), Action::start);
  service.started(1, 1, now_);
  service.becameReady();

  service.looked(false, work(24h), now_);

  EXPECT_EQ(service.action(true, now_), Action::none);
}

TEST_F(ServiceTest, IsBusyWithARequestThatTakesASecond) {
  start();
  service_.looked(false, work(2s), now_);
  EXPECT_FALSE(service_.work()) << "not while it is starting";
  service_.becameReady();

  service_.looked(false, work(999ms), now_);
  EXPECT_FALSE(service_.work());
  service_.looked(false, work(1s), now_);
  EXPECT_TRUE(service_.work());

  service_.looked(false, {}, now_);
  EXPECT_FALSE(service_.work());
}

TEST_F(ServiceTest, AStartThatFailsAsTheOneBeforeIsARepetition) {
  const auto failAgain = [&](int status) {
    EXPECT_EQ(action(), Action::start);
    service_.started(100, 7, now_);
    const auto isRepeated = service_.isRepeatedFailure(exited(status));
    end(exited(status));
    pass(1s);
    return isRepeated;
  };
  EXPECT_FALSE(failAgain(1)) << "the first one";
  EXPECT_TRUE(failAgain(1));
  EXPECT_FALSE(failAgain(3)) << "another end";
  service_.requestStart();

  becomeReady();

  EXPECT_FALSE(service_.isRepeatedFailure(exited(3))) << "it was ready";
  end(exited(3));
  pass(1s);
  EXPECT_FALSE(failAgain(3)) << "the first one since it was ready";
}

TEST_F(ServiceTest, AProcessThatCannotBeExecutedIsTriedAgain) {
  ASSERT_EQ(action(), Action::start);
  service_.startFailed("no such file", now_);

  EXPECT_EQ(service_.state(), ServiceState::pausing);
  EXPECT_EQ(service_.reason(), "no such file");
}

// The child was started, and ends by itself.
TEST_F(ServiceTest, AFailedStartOfAChildIsOneFailure) {
  ASSERT_EQ(action(), Action::start);
  service_.started(100, 7, now_);

  service_.startFailed("no such file", now_);

  EXPECT_FALSE(service_.isRunning());
  EXPECT_EQ(service_.pid(), 0);
  EXPECT_EQ(service_.restarts(), 1);
}

TEST_F(ServiceTest, AnAdoptedProcessKeepsItsAge) {
  service_.adopted(100, 7, 3, now_, now_ - 5'000'000'000);

  EXPECT_EQ(service_.state(), ServiceState::starting);
  EXPECT_EQ(service_.startedNs(), now_ - 5'000'000'000);
  EXPECT_EQ(service_.restarts(), 3);
  pass(4s);
  EXPECT_EQ(action(), Action::none) << "its time to become ready begins with the adoption";
}

TEST(ProcessEnd, HasAText) {
  EXPECT_EQ(exited(3).text(), "exit status 3");
  EXPECT_EQ(killedBy(SIGSEGV).text(), "SIGSEGV");
  EXPECT_EQ(killedBy(SIGRTMIN).text(), "signal 34") << "a real-time signal has no name";
  EXPECT_THAT(ProcessEnd().text(), HasSubstr("unknown"));
  EXPECT_TRUE(killedBy(SIGSEGV).isBySignal());
  EXPECT_FALSE(exited(0).isBySignal());
  EXPECT_FALSE(ProcessEnd().isBySignal());
}

}  // namespace
}  // namespace mpf::crate::test
