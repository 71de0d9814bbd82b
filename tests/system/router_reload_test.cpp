// SPDX-License-Identifier: MIT
// SIGHUP: a router reads its file again. What did not change is not disturbed.
#include <fmt/format.h>
#include <fstream>

#include "shm/layout.h"
#include "shm/segment.h"
#include "tests/support/temporary_folder.h"
#include "tests/system/router_fixture.h"

namespace mpf::test {
namespace {

// Routers with files. On the remote side, "echo" is at location 1, in this process, and "other" is
// a process at location 2.
class RouterReloadTest : public RouterTest {
 protected:
  void SetUp() override {
    writeFar({1, 2});
    writeNear({1, 2});
    farRouter_.emplace(RouterPair::Options{folder_.file("far.toml")});
    nearRouter_.emplace(RouterPair::Options{folder_.file("near.toml")});
    openServer();
    caller_.emplace(*dispatcher_);
    expectAnswer();
  }
  // Times that a busy host does not exceed. At the end of a file, so that `more` may add limits.
  static constexpr auto* kLimits = "[limits]\ndead-time = \"60s\"\nhandshake-time = \"60s\"\n";
  void writeFar(const std::vector<int>& locations, const std::string& more = {}) const {
    auto text = fmt::format("backplane = \"{}\"\n", routers_.far().name());
    for (const auto location : locations)
      text += fmt::format("[[serve]]\nlocation = {}\n", location);
    text += fmt::format("[[listen]]\naddress = \"{}\"\nsecurity = \"plain\"\n", routers_.address());
    folder_.write("far.toml", text + kLimits + more);
  }
  // Writes the file of the local router, with a remote for each location.
  void writeNear(const std::vector<int>& locations, const std::string& more = {}) const {
    auto text = fmt::format("backplane = \"{}\"\n", routers_.near().name());
    for (const auto location : locations) {
      text += fmt::format("[[remote]]\nlocations = {}\naddress = \"{}\"\nsecurity = \"plain\"\n",
                          location, routers_.address());
    }
    folder_.write("near.toml", text + kLimits + more);
  }
  static void reload(const RouterProcess& router, const std::string& said = "has been reloaded") {
    router.signal(SIGHUP);
    router.waitUntilSaid(said);
  }
  Caller& bindToOther() { return other_.emplace(*dispatcher_, "other", 2); }
  void expectAnswerOfOther() {
    runUntil([&] { return other_->isConnected(); });
    other_->send(Int32Message({.value = 77}));
    runUntil([&] { return !other_->messages.empty(); });
    EXPECT_EQ(other_->take().tryAs<Int32>()->value, 77);
  }
  void expectThatTheFirstNoticedNothing() {
    expectAnswer();
    EXPECT_THAT(caller_->news, testing::ElementsAre(ConnectStatus::connectYes));
    EXPECT_EQ(connectsToFirst(), 1u);
  }
  // How often the local router has connected to the remote of location 1, from its segment.
  [[nodiscard]] std::uint64_t connectsToFirst() const {
    std::uint64_t connects = 0;
    for (const auto& name : segments::list(SegmentName::prefix(routers_.near().name()) +
                                           static_cast<char>(NameKind::router))) {
      std::ifstream file(segments::path(name), std::ios::binary);
      file.seekg(layout::kRouterLinesOffset);
      layout::RouterLine line{};
      while (file.read(reinterpret_cast<char*>(&line), sizeof line)) {
        if (segments::text(line.locations) == "1")
          connects += line.connects.load(std::memory_order_relaxed);
      }
    }
    return connects;
  }
  void TearDown() override {
    other_.reset();
    otherServer_ = {};
    for (auto* const router : {&nearRouter_, &farRouter_}) EXPECT_EQ((*router)->end(SIGTERM), 0);
    RouterTest::TearDown();
  }

  TemporaryFolder folder_;
  std::optional<RouterProcess> nearRouter_;
  std::optional<RouterProcess> farRouter_;
  Victim otherServer_{MPF_TEST_INT32_SERVER,
                      std::vector<std::string>{"other", "--backplane", routers_.far().name(),
                                               "--location", "2", "--log-level", "warning"}};
  std::optional<Caller> other_;
};

TEST_F(RouterReloadTest, ALocationMayBeRemovedAndAddedAgain) {
  bindToOther();
  expectAnswerOfOther();

  writeFar({1});
  reload(*farRouter_);
  runUntil([&] { return other_->news.size() == 2; });
  EXPECT_EQ(other_->news.back(), ConnectStatus::connectNo);
  expectThatTheFirstNoticedNothing();

  writeFar({1, 2});
  farRouter_->signal(SIGHUP);
  expectAnswerOfOther();
  expectThatTheFirstNoticedNothing();
}

TEST_F(RouterReloadTest, ARemoteMayBeRemovedAndAddedAgain) {
  bindToOther();
  expectAnswerOfOther();

  writeNear({1});
  reload(*nearRouter_);
  runUntil([&] { return other_->news.size() == 2; });
  expectThatTheFirstNoticedNothing();

  writeNear({1, 2});
  nearRouter_->signal(SIGHUP);
  expectAnswerOfOther();
  expectThatTheFirstNoticedNothing();
}

TEST_F(RouterReloadTest, AnErrorInTheFileChangesNothing) {
  bindToOther();
  expectAnswerOfOther();

  writeFar({1}, "no-such-key = 1\n");
  reload(*farRouter_, "the old one stays in effect");
  writeNear({1}, "first-retry = 2\n");
  reload(*nearRouter_, "the old one stays in effect");

  expectAnswerOfOther();
  expectThatTheFirstNoticedNothing();
  EXPECT_THAT(other_->news, testing::ElementsAre(ConnectStatus::connectYes));
}

TEST_F(RouterReloadTest, NewLimitsApplyToNewConnections) {
  writeFar({1, 2}, "max-clients = 1\nqueue-size = 7\n");
  reload(*farRouter_);
  writeNear({1, 2}, "queue-size = 7\n");
  reload(*nearRouter_);

  expectThatTheFirstNoticedNothing();
  bindToOther();  // a second client of the same connection
  expectAnswerOfOther();
}

TEST_F(RouterReloadTest, AMappedLocationIsServed) {
  bindToOther();
  expectAnswerOfOther();
  const Victim elsewhere{MPF_TEST_INT32_SERVER,
                         std::vector<std::string>{"other", "--backplane", routers_.far().name(),
                                                  "--location", "9", "--log-level", "warning"}};

  writeFar({1}, "[[serve]]\nlocation = 2\nlocal = 9\n");
  reload(*farRouter_);
  runUntil([&] { return other_->news.size() == 3; });
  otherServer_ = {};

  expectAnswerOfOther();
  EXPECT_THAT(other_->news,
              testing::ElementsAre(ConnectStatus::connectYes, ConnectStatus::connectNo,
                                   ConnectStatus::connectYes));
  expectThatTheFirstNoticedNothing();
}

// The signal arrives while the router waits for the farewell of a stopped peer.
TEST_F(RouterReloadTest, ARouterThatIsEndingDoesNotReload) {
  farRouter_->stop();
  writeNear(
      {1},
      fmt::format("[[serve]]\nlocation = 3\n[[listen]]\naddress = \"{}\"\nsecurity = \"plain\"\n",
                  FreePort().address()));

  nearRouter_->signal(SIGTERM);
  nearRouter_->waitUntilSaid(" stopping");
  EXPECT_EQ(nearRouter_->end(SIGHUP), 0);

  EXPECT_THAT(nearRouter_->said(), testing::Not(testing::HasSubstr("reloaded")));
  farRouter_->resume();
}

// Repeated reloads under load: no message is lost or delivered twice.
TEST_F(RouterReloadTest, ReloadsUnderLoadLoseNothing) {
  int sent = 0;
  int answered = 0;
  for (int reloads = 0; reloads < 20; ++reloads) {
    writeFar(reloads % 2 == 0 ? std::vector{1} : std::vector{1, 2});
    farRouter_->signal(SIGHUP);
    nearRouter_->signal(SIGHUP);
    for (const auto until = sent + 100; answered < until;) {
      while (sent < until && sent - answered < 50) caller_->send(Int32Message({.value = sent++}));
      EXPECT_EQ(next().tryAs<Int32>()->value, answered++);
    }
  }
  expectThatTheFirstNoticedNothing();
}

}  // namespace
}  // namespace mpf::test
