// SPDX-License-Identifier: MIT
// Polling: the event loop stays awake after traffic, and sleeps later.
#include "router/polling.h"

#include <gtest/gtest.h>
#include <kj/async-io.h>

#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using router::Polling;

class PollingTest : public testing::Test {
 public:
  ~PollingTest() noexcept override = default;

 protected:
  void wait() { io_.provider->getTimer().afterDelay(kj::MILLISECONDS).wait(io_.waitScope); }

  const Watchdog watchdog_{"polling"};
  kj::AsyncIoContext io_ = kj::setupAsyncIo();
  Polling polling_{io_.unixEventPort};
};

TEST_F(PollingTest, EndsAWhileAfterTheLastTraffic) {
  EXPECT_FALSE(polling_.isPolling());

  polling_.noteTraffic();

  EXPECT_TRUE(polling_.isPolling());
  while (polling_.isPolling()) wait();
  polling_.noteTraffic();
  EXPECT_TRUE(polling_.isPolling()) << "again";
}

TEST_F(PollingTest, HandlesEventsOfDescriptors) {
  auto pipe = io_.provider->newTwoWayPipe();
  char byte = 0;
  auto read = pipe.ends[1]->read(&byte, 1).eagerlyEvaluate(nullptr);
  for (int i = 0; i < 3; ++i) {
    polling_.noteTraffic();
    wait();
  }

  polling_.noteTraffic();
  pipe.ends[0]->write("x", 1).wait(io_.waitScope);
  read.wait(io_.waitScope);

  EXPECT_EQ(byte, 'x');
}

}  // namespace
}  // namespace mpf::test
