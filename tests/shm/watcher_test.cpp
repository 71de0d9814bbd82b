// SPDX-License-Identifier: MIT
// Watcher: reports the death of peers and new names.
#include "shm/watcher.h"

#include <atomic>
#include <memory>
#include <semaphore>
#include <vector>

#include "tests/shm/child.h"
#include "tests/shm/shm_fixture.h"

namespace mpf::test {
namespace {

using layout::SegmentKind;

// Counts callbacks; the test waits for the next one.
class News {
 public:
  [[nodiscard]] Watcher::Callback callback() {
    return [this] {
      ++count_;
      came_.release();
    };
  }
  void wait() { came_.acquire(); }
  [[nodiscard]] int count() const { return count_; }

 private:
  std::atomic<int> count_{0};
  std::counting_semaphore<> came_{0};
};

class WatcherTest : public ShmTest {
 protected:
  using Describe = std::function<void(layout::SegmentHeader&)>;

  std::unique_ptr<Child> startServer(
      const std::string& server, const Describe& describe = [](layout::SegmentHeader&) {}) const {
    return std::make_unique<Child>([&](Child::Self& self) {
      const OwnWindow window(name(), SegmentKind::serverWindow, serverName(server), {}, describe);
      self.ready();
    });
  }
  std::shared_ptr<PeerWindow> open(const std::string& server) const {
    return PeerWindow::tryOpen(serverName(server), SegmentKind::serverWindow);
  }
  // Returns when the watcher has reported a death that happens after this call: it has then handled
  // all earlier events.
  void waitForAnotherDeath() {
    auto other = startServer("other");
    News news;
    watcher_.watchPeer(open("other"), news.callback());
    other->end(SIGKILL);
    news.wait();
  }
  void TearDown() override {
    static_cast<void>(backplane_.removeDead());
    ShmTest::TearDown();
  }

  Watcher& watcher_ = backplane_.watcher();
};

TEST_F(WatcherTest, ReportsADeathOnce) {
  const auto server = startServer("server");
  const auto peer = open("server");
  News news;
  watcher_.watchPeer(peer, news.callback());
  EXPECT_FALSE(peer->isDead());

  server->end(SIGKILL);
  news.wait();

  EXPECT_TRUE(peer->isDead());
  waitForAnotherDeath();
  EXPECT_EQ(news.count(), 1);
}

TEST_F(WatcherTest, ReportsAWindowThatIsClosed) {
  const auto server = startServer("server");
  const auto peer = open("server");
  News news;
  watcher_.watchPeer(peer, news.callback());

  server->go();
  news.wait();

  EXPECT_TRUE(peer->isDead());
  EXPECT_TRUE(peer->isClosed());
}

TEST_F(WatcherTest, ReportsAPeerThatWasDeadAlready) {
  const auto server = startServer("server");
  const auto peer = open("server");
  server->end(SIGKILL);
  News news;

  watcher_.watchPeer(peer, news.callback());

  news.wait();
}

TEST_F(WatcherTest, ReportsToEveryWatchOfAPeer) {
  const auto server = startServer("server");
  News first;
  News second;
  watcher_.watchPeer(open("server"), first.callback());
  watcher_.watchPeer(open("server"), second.callback());

  server->end(SIGKILL);

  first.wait();
  second.wait();
}

TEST_F(WatcherTest, ReportsEachOfManyDeathsOnce) {
  constexpr int kServers = 20;
  std::vector<std::unique_ptr<Child>> servers;
  std::vector<News> news(kServers);
  for (int i = 0; i < kServers; ++i) servers.push_back(startServer(std::to_string(i)));
  for (int i = 0; i < kServers; ++i)
    watcher_.watchPeer(open(std::to_string(i)), news[static_cast<std::size_t>(i)].callback());

  for (const auto& server : servers) ::kill(server->pid(), SIGKILL);

  for (auto& one : news) one.wait();
  waitForAnotherDeath();
  for (const auto& one : news) EXPECT_EQ(one.count(), 1);
}

TEST_F(WatcherTest, DoesNotReportAForgottenPeer) {
  const auto server = startServer("server");
  const auto peer = open("server");
  News news;
  const auto token = watcher_.watchPeer(peer, news.callback());

  watcher_.forget(token);
  server->end(SIGKILL);
  waitForAnotherDeath();

  EXPECT_EQ(news.count(), 0);
  EXPECT_FALSE(peer->isDead());
  watcher_.forget(token);
}

// forget() may be called while the callback runs. When it returns, the callback has ended.
TEST_F(WatcherTest, RunsNoCallbackAfterForget) {
  for (int round = 0; round < 50; ++round) {
    const auto server = startServer("server" + std::to_string(round));
    auto alive = std::make_unique<std::atomic<int>>(0);
    const auto token = watcher_.watchPeer(open("server" + std::to_string(round)),
                                          [&counter = *alive] { counter.fetch_add(1); });

    ::kill(server->pid(), SIGKILL);
    watcher_.forget(token);

    EXPECT_LE(alive->load(), 1);
    alive.reset();  // AddressSanitizer reports a callback that runs after this
    static_cast<void>(backplane_.removeDead());
  }
}

TEST_F(WatcherTest, ACallbackMayEndAndStartOtherWatches) {
  const auto first = startServer("first");
  const auto second = startServer("second");
  News news;
  News never;
  News later;
  std::atomic<Watcher::Token> own{0};
  const auto other = watcher_.watchPeer(open("second"), never.callback());
  own = watcher_.watchPeer(open("first"), [&] {
    watcher_.forget(own);
    watcher_.forget(other);
    watcher_.watchPeer(open("second"), later.callback());
    news.callback()();
  });

  first->end(SIGKILL);
  news.wait();
  second->end(SIGKILL);
  later.wait();

  EXPECT_EQ(never.count(), 0);
}

TEST_F(WatcherTest, AStoppedProcessIsNotDead) {
  const auto server = startServer("server");
  const auto peer = open("server");
  News news;
  watcher_.watchPeer(peer, news.callback());

  server->stop();
  waitForAnotherDeath();

  EXPECT_EQ(news.count(), 0);
  EXPECT_FALSE(peer->isDead());
  server->resume();
  server->end(SIGKILL);
  news.wait();
}

class HiddenOwners : public WatcherTest,
                     public testing::WithParamInterface<void (*)(layout::SegmentHeader&)> {};

// If the header names no process that this process can find, only the lock decides.
TEST_P(HiddenOwners, AreWatchedThroughTheirLocks) {
  const auto server = startServer("server", GetParam());
  const auto peer = open("server");
  News news;
  watcher_.watchPeer(peer, news.callback());
  waitForAnotherDeath();
  EXPECT_EQ(news.count(), 0) << "it is alive";

  server->end(SIGKILL);

  news.wait();
  EXPECT_TRUE(peer->isDead());
}
INSTANTIATE_TEST_SUITE_P(
    Hidden, HiddenOwners,
    testing::Values([](layout::SegmentHeader& header) { ++header.pidNamespace; },
                    [](layout::SegmentHeader& header) { header.ownerStartTicks = 0; },
                    [](layout::SegmentHeader& header) { header.ownerPid = 0; },
                    [](layout::SegmentHeader& header) { header.ownerPid = INT32_MIN; }));

// A child of the owner has none of the owner's locks.
TEST_F(WatcherTest, AChildDoesNotKeepItsDeadParentAlive) {
  const auto server = std::make_unique<Child>([&](Child::Self& self) {
    const OwnWindow window(name(), SegmentKind::serverWindow, serverName(), {},
                           [](layout::SegmentHeader&) {});
    if (::fork() == 0) {
      ::prctl(PR_SET_PDEATHSIG, 0);
      self.ready();  // the grandchild runs until the test calls go()
      ::_exit(0);
    }
    ::pause();
  });
  const auto peer = open("server");
  News news;
  watcher_.watchPeer(peer, news.callback());

  const auto pid = server->pid();
  ::kill(pid, SIGKILL);
  siginfo_t ended{};
  ::waitid(P_PID, static_cast<id_t>(pid), &ended, WEXITED | WNOWAIT);

  news.wait();
  server->go();
  EXPECT_TRUE(peer->isDead());
}

TEST_F(WatcherTest, ReportsANewServer) {
  News news;
  const auto token = watcher_.watchNames(NameKind::serverWindow, news.callback());

  const auto server = startServer("server");
  news.wait();

  EXPECT_TRUE(open("server"));
  watcher_.forget(token);
}

TEST_F(WatcherTest, ReportsANewServerToEveryWatch) {
  News first;
  News second;
  News third;
  const auto firstToken = watcher_.watchNames(NameKind::serverWindow, first.callback());
  const auto secondToken = watcher_.watchNames(NameKind::serverWindow, [&] {
    watcher_.forget(firstToken);
    second.callback()();
  });

  const auto server = startServer("server");
  second.wait();
  watcher_.forget(secondToken);
  const auto heard = second.count();
  const auto thirdToken = watcher_.watchNames(NameKind::serverWindow, third.callback());
  const auto other = startServer("other");
  third.wait();

  EXPECT_EQ(second.count(), heard);
  watcher_.forget(thirdToken);
}

}  // namespace
}  // namespace mpf::test
