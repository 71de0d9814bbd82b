// SPDX-License-Identifier: MIT
// DueWrites: when the writers write.
#include "router/due_writes.h"

#include <functional>
#include <gtest/gtest.h>
#include <kj/async-io.h>

#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using router::DueWrites;

struct Written final : router::DueWriter {
  void writeDue() noexcept override {
    ++writes;
    if (onWrite) onWrite();
  }
  int writes = 0;
  std::function<void()> onWrite;
};

class DueWritesTest : public testing::Test {
 public:
  ~DueWritesTest() noexcept override = default;

 protected:
  const Watchdog watchdog_{"due writes"};
  kj::AsyncIoContext io_ = kj::setupAsyncIo();
  DueWrites due_{io_.provider->getTimer()};
  Written first_;
  Written second_;
};

TEST_F(DueWritesTest, AreWrittenAfterTheTasksThatAreReady) {
  int writesAtTask = -1;
  due_.add(first_);
  auto task = kj::evalLater([&] {
                writesAtTask = first_.writes;
                due_.add(second_);
              }).eagerlyEvaluate(nullptr);

  io_.waitScope.poll();

  EXPECT_EQ(writesAtTask, 0);
  EXPECT_EQ(first_.writes, 1);
  EXPECT_EQ(second_.writes, 1);
}

TEST_F(DueWritesTest, AreWrittenByRunOnce) {
  due_.setDriven(true);
  due_.add(first_);
  io_.waitScope.poll();
  EXPECT_EQ(first_.writes, 0) << "its caller has not called run()";

  due_.run();
  due_.run();

  EXPECT_EQ(first_.writes, 1);
}

TEST_F(DueWritesTest, AreWrittenWhenNobodyCallsRunAnyLonger) {
  due_.setDriven(true);
  due_.add(first_);

  due_.setDriven(false);
  io_.waitScope.poll();

  EXPECT_EQ(first_.writes, 1);
}

TEST_F(DueWritesTest, ThatAreAddedMeanwhileWaitForTheNextRun) {
  due_.setDriven(true);
  first_.onWrite = [&] {
    due_.add(first_);
    due_.run();
  };
  due_.add(first_);

  due_.run();
  EXPECT_EQ(first_.writes, 1);

  due_.run();
  EXPECT_EQ(first_.writes, 2);
}

TEST_F(DueWritesTest, AreNotWrittenAfterRemove) {
  first_.onWrite = [&] { due_.remove(second_); };
  Written third;
  for (auto* const each : {&first_, &second_, &third}) due_.add(*each);

  due_.remove(third);
  due_.run();
  io_.waitScope.poll();

  EXPECT_EQ(first_.writes, 1);
  EXPECT_EQ(second_.writes, 0);
  EXPECT_EQ(third.writes, 0);
}

}  // namespace
}  // namespace mpf::test
