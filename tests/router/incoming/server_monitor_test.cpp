// SPDX-License-Identifier: MIT
// ServerMonitor: a server that cannot be watched for lack of memory, and one ServerMonitor for
// several users.
#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>
#include <gtest/gtest.h>
#include <kj/async-io.h>
#include <memory>
#include <optional>

#include <mpf/message_server.h>

#include "router/incoming/server_monitors.h"
#include "tests/support/sanitized.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::router::test {
namespace {

// Limits the memory so that a window can be mapped, but no thread can be started.
class NoMoreThreads {
 public:
  NoMoreThreads() {
    constexpr std::size_t kLeftBytes = 64 << 20;
    ::pthread_attr_init(&threads_);
    // Larger than any cached stack of a thread that has ended.
    ::pthread_attr_setstacksize(&threads_, 2 * kLeftBytes);
    ::pthread_setattr_default_np(&threads_);
    ::getrlimit(RLIMIT_AS, &before_);
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    const rlimit limit{pages * static_cast<std::size_t>(::getpagesize()) + kLeftBytes,
                       before_.rlim_max};
    ::setrlimit(RLIMIT_AS, &limit);
  }
  ~NoMoreThreads() {
    ::setrlimit(RLIMIT_AS, &before_);
    ::pthread_attr_destroy(&threads_);
  }
  NoMoreThreads(const NoMoreThreads&) = delete;
  NoMoreThreads& operator=(const NoMoreThreads&) = delete;

 private:
  rlimit before_{};
  pthread_attr_t threads_{};
};

// The end of the server would not be noticed. A later look() finds the server.
TEST(ServerMonitor, IsDoubtfulWhenTheServerCannotBeWatched) {
  if (mpf::test::kIsSanitized) GTEST_SKIP() << "the sanitizer reserves the address space";
  const mpf::test::TestBackplane servers;
  const MessageServer server(servers, "echo", {});
  // With a backplane of its own, whose watcher thread has not started.
  ServerMonitor monitor(Backplane::attach(servers.name()), {0, "echo"}, [] {});

  {
    const NoMoreThreads none;
    EXPECT_FALSE(monitor.look());
  }
  EXPECT_TRUE(monitor.isDoubtful()) << monitor.problem();
  EXPECT_EQ(monitor.incarnation(), 0u);

  EXPECT_TRUE(monitor.look());
  EXPECT_EQ(monitor.problem(), "");
}

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
