// SPDX-License-Identifier: MIT
// Presence: a server that cannot be watched for lack of memory, and one Presence for several users.
#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>
#include <gtest/gtest.h>
#include <kj/async-io.h>
#include <memory>
#include <optional>

#include <mpf/message_server.h>

#include "router/incoming/presences.h"
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
TEST(Presence, IsDoubtfulWhenTheServerCannotBeWatched) {
  if (mpf::test::kIsSanitized) GTEST_SKIP() << "the sanitizer reserves the address space";
  const mpf::test::TestBackplane servers;
  const MessageServer server(servers, "echo", {});
  // With a backplane of its own, whose watcher thread has not started.
  Presence presence(Backplane::attach(servers.name()), {0, "echo"}, [] {});

  {
    const NoMoreThreads none;
    EXPECT_FALSE(presence.look());
  }
  EXPECT_TRUE(presence.isDoubtful()) << presence.problem();
  EXPECT_EQ(presence.incarnation(), 0u);

  EXPECT_TRUE(presence.look());
  EXPECT_EQ(presence.problem(), "");
}

// All users of a server share one Presence, which is destroyed with the last of them.
TEST(Presences, HaveOnePresenceForEachServer) {
  const mpf::test::TestBackplane servers;
  auto io = kj::setupAsyncIo();
  Presences presences(servers, io.unixEventPort, [] {});
  auto first = presences.of({0, "echo"});
  auto second = presences.of({0, "echo"});
  const auto elsewhere = presences.of({1, "echo"});
  EXPECT_EQ(first, second);
  EXPECT_NE(first, elsewhere);
  const std::weak_ptr<Presence> gone = first;

  first.reset();
  EXPECT_EQ(presences.of({0, "echo"}), second);
  second.reset();
  EXPECT_TRUE(gone.expired());
}

// A look() that finds a change notifies the users that did not call it.
TEST(Presences, NotifyAllUsersOfAChange) {
  const mpf::test::Watchdog watchdog("presences");
  const mpf::test::TestBackplane servers;
  auto io = kj::setupAsyncIo();
  int changes = 0;
  Presences presences(servers, io.unixEventPort, [&] { ++changes; });
  const auto presence = presences.of({0, "echo"});
  io.waitScope.poll();
  std::optional<MessageServer> server(std::in_place, servers, "echo", ServerOptions{});
  ASSERT_TRUE(presence->look());
  while (changes == 0) io.waitScope.poll();  // the name of the server has appeared

  server.reset();
  changes = 0;
  EXPECT_FALSE(presence->look());
  EXPECT_FALSE(presence->isDoubtful());
  io.waitScope.poll();
  EXPECT_GT(changes, 0);
}

}  // namespace
}  // namespace mpf::router::test
