// SPDX-License-Identifier: MIT
// PeerWindows: which window a name stands for, and the report of its owner's death.
#include "shm/peer_windows.h"

#include <signal.h>

#include <atomic>
#include <memory>
#include <optional>

#include "tests/shm/child.h"
#include "tests/shm/dead_server.h"
#include "tests/shm/shm_fixture.h"

namespace mpf::test {
namespace {

using layout::SegmentKind;

class PeerWindowsTest : public ShmTest {
 protected:
  // A process with the window of a server. It closes the window, but does not remove it, when the
  // test calls go().
  std::unique_ptr<Child> startServer() {
    return std::make_unique<Child>([this](Child::Self& self) {
      const OwnWindow window(name(), SegmentKind::serverWindow, serverName(), {},
                             [](layout::SegmentHeader&) {});
      self.ready();
      window.control().state.store(layout::WindowState::closed, std::memory_order_relaxed);
      self.stay();
    });
  }
  std::shared_ptr<PeerWindow> open() {
    return peers_->tryOpen(serverName(), SegmentKind::serverWindow);
  }
  std::shared_ptr<PeerWindow> openAndWatch() {
    auto window = open();
    peers_->settle();
    return window;
  }
  void waitForDeaths(int deaths) {
    for (auto now = deaths_.load(); now < deaths; now = deaths_.load()) deaths_.wait(now);
  }
  void TearDown() override {
    peers_.reset();
    static_cast<void>(backplane_.removeDead());
    ShmTest::TearDown();
  }

  std::atomic<int> deaths_{0};
  std::optional<PeerWindows> peers_{std::in_place, backplane_, [this] {
                                      ++deaths_;
                                      deaths_.notify_all();
                                    }};
};

TEST_F(PeerWindowsTest, AWindowThatDoesNotExistIsNotOpened) { EXPECT_EQ(open(), nullptr); }

TEST_F(PeerWindowsTest, AWindowIsMappedOnce) {
  const auto server = startServer();

  const auto window = open();

  ASSERT_TRUE(window);
  EXPECT_EQ(open(), window);
}

TEST_F(PeerWindowsTest, ADeathIsReportedAfterTheFilesAreRemoved) {
  const auto server = startServer();
  const auto window = openAndWatch();

  server->end(SIGKILL);
  waitForDeaths(1);

  EXPECT_TRUE(window->isDead());
  EXPECT_THAT(backplane_.segmentNames(), testing::IsEmpty());
  EXPECT_EQ(open(), nullptr);
}

// The timer of the watcher finds the death.
TEST_F(PeerWindowsTest, ADeathIsReportedEvenIfTheWindowIsNotWatchedClosely) {
  const auto server = startServer();
  const auto window = open();

  server->end(SIGKILL);
  waitForDeaths(1);

  EXPECT_TRUE(window->isDead());
}

TEST_F(PeerWindowsTest, TheProcessOfAPeerIsOpenedWhenThePeersSettle) {
  const auto server = startServer();
  const auto window = open();
  EXPECT_FALSE(window->process());

  peers_->settle();

  EXPECT_TRUE(window->process());
}

TEST_F(PeerWindowsTest, AnOwnerThatDiedBeforeTheOpenIsReportedEvenIfItsWindowIsLocked) {
  const DeadServer server(name(), serverName());

  const auto window = openAndWatch();
  ASSERT_TRUE(window);
  waitForDeaths(1);

  EXPECT_TRUE(window->isDead());
  EXPECT_EQ(open(), nullptr);
}

TEST_F(PeerWindowsTest, ADeathIsReportedOnceHoweverOftenTheWindowIsWatched) {
  const auto server = startServer();
  const auto window = openAndWatch();
  peers_->settle();

  server->end(SIGKILL);
  waitForDeaths(1);
  peers_.reset();  // no report comes after this

  EXPECT_EQ(deaths_, 1);
}

TEST_F(PeerWindowsTest, TheLastReleaseUnmapsAWindow) {
  const auto server = startServer();
  auto first = openAndWatch();
  auto second = open();
  const std::weak_ptr<PeerWindow> window = first;

  peers_->release(std::move(first));
  EXPECT_FALSE(window.expired()) << "another link uses it";
  EXPECT_EQ(open(), second);
  peers_->release(std::move(second));

  EXPECT_TRUE(window.expired());
}

// A server that is killed while it shuts down has closed its window, but not yet its links.
TEST_F(PeerWindowsTest, AClosedWindowIsWatchedUntilItsOwnerDies) {
  const auto server = startServer();
  const auto window = openAndWatch();
  server->go();
  ASSERT_TRUE(server->waitUntilReady());
  EXPECT_EQ(open(), nullptr) << "new links do not use it";

  server->end(SIGKILL);
  waitForDeaths(1);

  EXPECT_TRUE(window->isDead());
}

TEST_F(PeerWindowsTest, AfterADeathTheNameStandsForTheSuccessor) {
  auto server = startServer();
  const auto former = openAndWatch();
  server->end(SIGKILL);
  waitForDeaths(1);

  server = startServer();
  const auto present = openAndWatch();

  ASSERT_TRUE(present);
  EXPECT_NE(present, former);
  EXPECT_FALSE(present->isDead());
  EXPECT_EQ(open(), present);
  server->end(SIGKILL);
  waitForDeaths(2);
}

TEST_F(PeerWindowsTest, NothingIsReportedAfterTheDestructor) {
  const auto server = startServer();
  const auto window = openAndWatch();
  PeerWindows others(backplane_, [this] {
    deaths_ += 10;
    deaths_.notify_all();
  });
  const auto same = others.tryOpen(serverName(), SegmentKind::serverWindow);

  peers_.reset();
  server->end(SIGKILL);
  waitForDeaths(10);

  EXPECT_EQ(deaths_, 10);
}

}  // namespace
}  // namespace mpf::test
