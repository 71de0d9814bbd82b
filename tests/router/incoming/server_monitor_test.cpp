// SPDX-License-Identifier: MIT
// ServerMonitor: a server that cannot be watched for lack of memory.
#include "router/incoming/server_monitor.h"

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>
#include <gtest/gtest.h>

#include <mpf/message_server.h>

#include "tests/support/sanitized.h"
#include "tests/support/test_backplane.h"

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

}  // namespace
}  // namespace mpf::router::test
