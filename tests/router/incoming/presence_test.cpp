// SPDX-License-Identifier: MIT
// Whether a server is there, when not all that it takes to look is to be had.
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

// Memory for a window and for much else, but not for the stack of a thread.
class NoMoreThreads {
 public:
  NoMoreThreads() {
    constexpr std::size_t kLeftBytes = 64 << 20;
    ::pthread_attr_init(&threads_);
    ::pthread_attr_setstacksize(&threads_,
                                2 * kLeftBytes);  // none that has ended had one that would do
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

// Nobody would say when it ends: whoever asks again, later, finds it.
TEST(Presence, OfAServerThatCannotBeWatchedIsInDoubt) {
  if (mpf::test::kIsSanitized) GTEST_SKIP() << "the sanitizer has all memory for its own";
  const mpf::test::TestBackplane servers;
  const MessageServer server(servers, "echo", {});
  // whose watcher has yet to begin
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

// However many have bound to it, there is one; and none once they have all gone.
TEST(Presences, HaveOneOfEachServer) {
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

// Who did not look himself hears that there is something to see.
TEST(Presences, TellWhoDidNotLook) {
  const mpf::test::Watchdog watchdog("presences");
  const mpf::test::TestBackplane servers;
  auto io = kj::setupAsyncIo();
  int news = 0;
  Presences presences(servers, io.unixEventPort, [&] { ++news; });
  const auto presence = presences.of({0, "echo"});
  io.waitScope.poll();
  std::optional<MessageServer> server(std::in_place, servers, "echo", ServerOptions{});
  ASSERT_TRUE(presence->look());
  while (news == 0) io.waitScope.poll();  // of its name

  server.reset();
  news = 0;
  EXPECT_FALSE(presence->look());
  EXPECT_FALSE(presence->isDoubtful());
  io.waitScope.poll();
  EXPECT_GT(news, 0);
}

}  // namespace
}  // namespace mpf::router::test
