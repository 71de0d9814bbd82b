// SPDX-License-Identifier: MIT
// ServerMonitors: one ServerMonitor for all users of a server.
#include "router/incoming/server_monitors.h"

#include <gtest/gtest.h>
#include <kj/async-io.h>
#include <memory>
#include <optional>

#include <mpf/message_server.h>

#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::router::test {
namespace {

// All users of a server share one ServerMonitor, which is destroyed with the last of them.
TEST(ServerMonitors, HaveOneMonitorForEachServer) {
  const mpf::test::TestBackplane servers;
  auto io = kj::setupAsyncIo();
  ServerMonitors monitors(servers, io.unixEventPort, [] {});
  auto first = monitors.of({0, "echo"});
  auto second = monitors.of({0, "echo"});
  const auto elsewhere = monitors.of({1, "echo"});
  EXPECT_EQ(first, second);
  EXPECT_NE(first, elsewhere);
  const std::weak_ptr<ServerMonitor> gone = first;

  first.reset();
  EXPECT_EQ(monitors.of({0, "echo"}), second);
  second.reset();
  EXPECT_TRUE(gone.expired());
}

TEST(ServerMonitors, LookForAllUsersAtOnce) {
  const mpf::test::TestBackplane servers;
  auto io = kj::setupAsyncIo();
  ServerMonitors monitors(servers, io.unixEventPort, [] {});
  const auto echo = monitors.of({0, "echo"});
  const auto dac = monitors.of({0, "dac"});
  std::optional<MessageServer> server(std::in_place, servers, "echo", ServerOptions{});

  monitors.lookAtAll();
  EXPECT_TRUE(echo->isThere());
  EXPECT_FALSE(dac->isThere());

  server.reset();
  monitors.lookAtAll();
  EXPECT_FALSE(echo->isThere());
}

// A look() that finds a change notifies the users that did not call it.
TEST(ServerMonitors, NotifyAllUsersOfAChange) {
  const mpf::test::Watchdog watchdog("monitors");
  const mpf::test::TestBackplane servers;
  auto io = kj::setupAsyncIo();
  int changes = 0;
  ServerMonitors monitors(servers, io.unixEventPort, [&] { ++changes; });
  const auto monitor = monitors.of({0, "echo"});
  io.waitScope.poll();
  std::optional<MessageServer> server(std::in_place, servers, "echo", ServerOptions{});
  ASSERT_TRUE(monitor->look());
  while (changes == 0) io.waitScope.poll();  // the name of the server has appeared

  server.reset();
  changes = 0;
  EXPECT_FALSE(monitor->look());
  EXPECT_FALSE(monitor->isDoubtful());
  io.waitScope.poll();
  EXPECT_GT(changes, 0);
}

}  // namespace
}  // namespace mpf::router::test
