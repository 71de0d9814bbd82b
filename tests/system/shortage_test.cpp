// SPDX-License-Identifier: MIT
// A server without file descriptors reports it to its clients, in its window and in its log.
#include <sys/resource.h>

#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <mpf/message_client.h>

#include "base/system_call.h"
#include "shm/segment_name.h"
#include "shm/window.h"
#include "tests/support/test_backplane.h"
#include "tests/support/victim.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

class ShortageTest : public testing::Test {
 protected:
  // Sets the soft limit of open files of the server. Open descriptors above it stay open.
  void limitFiles(rlim_t files) const {
    const rlimit limit{files, before_.rlim_max};
    checkCall(::prlimit(server_.pid(), RLIMIT_NOFILE, &limit, nullptr), "prlimit");
  }
  void SetUp() override {
    ASSERT_EQ(server_.line(), "open");
    checkCall(::prlimit(server_.pid(), RLIMIT_NOFILE, nullptr, &before_), "prlimit");
    window_ = PeerWindow::tryOpen(SegmentName::serverWindow(backplane_.name(), 0, "echo"),
                                  layout::SegmentKind::serverWindow);
    ASSERT_TRUE(window_);
  }
  void run(const std::function<bool()>& until) {
    while (!until())
      static_cast<void>(dispatcher_.runOnce(Deadline::after(std::chrono::milliseconds(10))));
  }
  [[nodiscard]] std::uint64_t alarms() const {
    return window_->control().alarms.load(std::memory_order_relaxed);
  }
  [[nodiscard]] layout::Shortage shortage() const {
    return window_->control().shortage.load(std::memory_order_relaxed);
  }

  Watchdog watchdog_{"shortage test"};
  TestBackplane backplane_;
  Victim server_{"serve", backplane_.name()};
  std::shared_ptr<PeerWindow> window_;
  rlimit before_{};
  Dispatcher dispatcher_{backplane_};
  MessageClient client_{dispatcher_, [](const Message&) {}};
};

TEST_F(ShortageTest, OfDescriptorsIsReportedToTheClientAndCountedOnce) {
  limitFiles(0);

  client_.bind("echo", 0);
  run([&] {
    return client_.notConnectedBecause().find("no file descriptor left") != std::string::npos;
  });

  EXPECT_THAT(client_.notConnectedBecause(),
              testing::AllOf(testing::HasSubstr("\"echo\""), testing::HasSubstr("ulimit -n")));
  EXPECT_EQ(shortage(), layout::Shortage::descriptors);
  EXPECT_EQ(alarms(), 1U) << "one shortage, even if the client knocks several times";

  limitFiles(before_.rlim_cur);
  run([&] { return client_.isConnected(); });

  EXPECT_EQ(shortage(), layout::Shortage::none);
  EXPECT_EQ(alarms(), 1U);
}

}  // namespace
}  // namespace mpf::test
