// SPDX-License-Identifier: MIT
// Two hosts and the line between them: slow, lossy, out of order, or cut without notice. Uses
// network namespaces and tun devices; skipped where these are not allowed.
#include <sched.h>
#include <sys/mount.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <system_error>

#include <mpf/clock.h>

#include "base/system_call.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/wire.h"
#include "tests/system/router_fixture.h"

namespace mpf::test {
namespace {

constexpr std::int64_t kDefaultDeadTimeNs = 2'000'000'000;

// Creates the line before the routers start.
struct WiredHosts {
  WiredHosts() {
    try {
      wire = std::make_unique<Wire>();
    } catch (const std::system_error& error) {
      whyNot = error.what();
    }
  }
  std::unique_ptr<Wire> wire;
  std::string whyNot;
};

class RouterNetworkTest : public WiredHosts, public RouterTest {
 protected:
  RouterNetworkTest()
      : RouterTest({.address = std::string(Wire::kFar) + ":9900",
                    .enterNear = [this] { wire->enterNear(); },
                    .enterFar = [this] { wire->enterFar(); }}) {}
  void SetUp() override {
    if (!wire) GTEST_SKIP() << "no network namespaces here: " << whyNot;
  }
  // Both routers notice this after the dead time. The kernel would notice it later.
  void expectBothMissedTheOther() {
    for (auto* const router : {&routers_.nearRouter(), &routers_.farRouter()})
      router->waitUntilSaid("received nothing from the peer");
  }
};

// A name with several addresses, of which all but the last one do not answer.
class RouterManyAddressesTest : public WiredHosts, public RouterTest {
 protected:
  RouterManyAddressesTest()
      : RouterTest({.address = "far.test:9900",
                    .enterNear = [this] { enterNear(); },
                    .enterFar = [this] { enterFar(); }}) {
    folder_.write("hosts-near", "10.77.0.3 far.test\n10.77.0.4 far.test\n" +
                                    std::string(Wire::kFar) + " far.test\n");
    folder_.write("hosts-far", std::string(Wire::kFar) + " far.test\n");
  }
  void SetUp() override {
    if (!wire) GTEST_SKIP() << "no network namespaces here: " << whyNot;
  }
  // Runs in the router's process.
  void readHosts(const std::string& file) const {
    checkCall(::unshare(CLONE_NEWNS), "unshare");
    checkCall(::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr), "mount", "/");
    checkCall(::mount(folder_.file(file).c_str(), "/etc/hosts", nullptr, MS_BIND, nullptr), "mount",
              file);
  }
  void enterNear() const {
    wire->enterNear();
    readHosts("hosts-near");
  }
  void enterFar() const {
    wire->enterFar();
    readHosts("hosts-far");
  }
  TemporaryFolder folder_;
};

TEST_F(RouterManyAddressesTest, EachAddressIsTriedWithItsOwnTimeout) {
  startAll(kSoonDead);

  expectAnswer();
}

// ---- bad lines that are not cut: every request gets its reply

class RouterWeatherTest : public RouterNetworkTest,
                          public testing::WithParamInterface<std::pair<const char*, Weather>> {};

TEST_P(RouterWeatherTest, EachRequestGetsItsOneReplyInOrder) {
  constexpr int kClients = 4;
  constexpr int kRequests = 100;
  startAll(kPatient);
  serveOnceEach();
  std::vector<std::unique_ptr<Caller>> callers;
  for (int i = 0; i < kClients; ++i) callers.push_back(std::make_unique<Caller>(*dispatcher_));
  runUntil([&] {
    return std::ranges::all_of(callers, [](const auto& each) { return each->isConnected(); });
  });

  wire->behave(GetParam().second);
  std::array<int, kClients> sent{};
  std::array<int, kClients> answered{};
  runUntil([&] {
    for (std::size_t at = 0; at < kClients; ++at) {
      auto& caller = *callers[at];
      const auto first = static_cast<int>(at) * 1000;
      while (sent.at(at) < kRequests && caller.open.size() < 10) {
        auto request = caller.client.alloc<Int32Array>(sent.at(at) % 7 == 0 ? 1000 : 1);
        request.value()[0] = first + sent.at(at)++;
        caller.send(std::move(request));
      }
      for (auto message = caller.take(); message; message = caller.take())
        EXPECT_EQ(numberOf(message), first + answered.at(at)++);
    }
    return std::ranges::count(answered, kRequests) == kClients;
  });
  wire->behave({});

  EXPECT_EQ(delivered_.size(), kClients * kRequests);
  for (const auto& caller : callers)
    EXPECT_THAT(caller->news, testing::ElementsAre(ConnectStatus::connectYes));
}

INSTANTIATE_TEST_SUITE_P(
    In, RouterWeatherTest,
    testing::Values(std::pair{"Delay", Weather{.delay = 20ms}},
                    std::pair{"Loss", Weather{.lostPerThousand = 50}},
                    std::pair{"Reordering", Weather{.delay = 10ms, .overtakingPerThousand = 200}},
                    std::pair{"AllOfIt", Weather{.delay = 20ms,
                                                 .lostPerThousand = 50,
                                                 .overtakingPerThousand = 100}}),
    [](const auto& parameter) { return parameter.param.first; });

// ---- cuts

TEST_F(RouterNetworkTest, ACutIsNoticedAfterTheDeadTimeAndEachRequestGetsItsFate) {
  startAll({"--dead-time", "2s"});
  caller_->send(Int32Message({.value = 1000}));
  const auto kept = nextRequest();
  serveOnceEach();
  const auto beforeNs = Clock::nowNs();
  expectAnswer();  // both routers have received messages of each other since then

  wire->cut();
  for (int i = 1; i <= 5; ++i) caller_->send(Int32Message({.value = 1000 + i}));
  waitForNews(ConnectStatus::connectNo);

  EXPECT_GE(Clock::nowNs() - beforeNs, kDefaultDeadTimeNs);
  EXPECT_EQ(caller_->messages.size(), 6u);
  for (auto message = caller_->take(); message; message = caller_->take())
    EXPECT_EQ(fateOf(message), Fate::outcomeUnknown);
  runUntil([&] { return server_->clientOf(kept) == 0; });
  expectBothMissedTheOther();
  wire->mend();
  expectAnswer();
  EXPECT_THAT(caller_->news,
              testing::ElementsAre(ConnectStatus::connectYes, ConnectStatus::connectNo,
                                   ConnectStatus::connectYes));
}

TEST_F(RouterNetworkTest, BothSidesNoticeACutOfAnIdleLine) {
  startAll(kSoonDead);
  for (int round = 0; round < 2; ++round) {
    caller_->send(Int32Message());
    auto kept = nextRequest();
    const auto client = kept.duplicate();
    static_cast<void>(server_->reply(std::move(kept)));
    static_cast<void>(next());

    wire->cut();

    waitForNews(ConnectStatus::connectNo);
    runUntil([&] { return server_->clientOf(client) == 0; });
    expectBothMissedTheOther();
    wire->mend();
    expectAnswer();
  }
}

TEST_F(RouterNetworkTest, ACutInOneDirectionClosesTheConnection) {
  startAll(kSoonDead);
  serveOnceEach();
  for (const auto direction : {Direction::toFar, Direction::toNear}) {
    expectAnswer();
    const auto number = -1 - static_cast<std::int32_t>(direction);

    wire->cut(direction);
    caller_->send(Int32Message({.value = number}));

    waitForNews(ConnectStatus::connectNo);
    EXPECT_EQ(fateOf(next()), Fate::outcomeUnknown);
    wire->mend();
    expectAnswer();
    EXPECT_EQ(delivered_.contains(number), direction == Direction::toNear);
  }
}

TEST_F(RouterNetworkTest, ACutShorterThanTheDeadTimeLosesNothing) {
  startAll(kPatient);
  serveOnceEach();
  expectAnswer();

  wire->cut();
  for (int i = 0; i < 50; ++i) caller_->send(Int32Message({.value = 1000 + i}));
  runFor(500ms);
  EXPECT_THAT(caller_->messages, testing::IsEmpty());
  wire->mend();

  for (int i = 0; i < 50; ++i) EXPECT_EQ(next().tryAs<Int32>()->value, 1000 + i);
  EXPECT_THAT(caller_->news, testing::ElementsAre(ConnectStatus::connectYes));
}

// Requests that did not fit into the line were not carried out, and their fates say so.
TEST_F(RouterNetworkTest, RequestsThatNeverReachedTheLineAreNeverTaken) {
  // More than the kernel buffers for a line that is cut.
  constexpr std::size_t kElements = 1 << 18;
  startAll(kSoonDead);
  serveOnceEach();
  expectAnswer();

  wire->cut();
  std::vector<std::uint32_t> ids;
  while (ids.size() < 40) {
    auto request = caller_->client.alloc<Int32Array>(kElements);
    request.value()[0] = 1000 + static_cast<std::int32_t>(ids.size());
    ids.push_back(caller_->send(std::move(request)));
  }
  waitForNews(ConnectStatus::connectNo);

  std::set<Fate> fates;
  EXPECT_EQ(caller_->messages.size(), ids.size());
  for (auto message = caller_->take(); message; message = caller_->take())
    fates.insert(fateOf(message).value());
  EXPECT_THAT(fates, testing::UnorderedElementsAre(Fate::outcomeUnknown, Fate::neverTaken));
  wire->mend();
  expectAnswer();
}

// ---- hosts that restart while the line is cut

TEST_F(RouterNetworkTest, AHostThatIsSilentForAWhileIsConnectedAgain) {
  startAll(kSoonDead);
  for (const bool isMissed : {true, false}) {
    const auto news = caller_->news.size();
    expectAnswer();

    wire->cut();
    routers_.farRouter().end(SIGKILL);
    server_.reset();
    if (isMissed) waitForNews(ConnectStatus::connectNo);
    routers_.startFar(kSoonDead);
    openServer();
    wire->mend();

    runUntil([&] { return caller_->news.size() >= news + 2; });
    expectAnswer();
  }
}

TEST_F(RouterNetworkTest, TheClientsOfASilentHostAreDisconnected) {
  startAll(kSoonDead);
  caller_->send(Int32Message());
  const auto kept = nextRequest();

  wire->cut();
  routers_.nearRouter().end(SIGKILL);
  runUntil([&] { return server_->clientOf(kept) == 0; });
  routers_.startNear();
  wire->mend();

  waitForNews(ConnectStatus::connectYes);
  static_cast<void>(caller_->take());
  expectAnswer();
}

TEST_F(RouterNetworkTest, ARouterWithoutAnAnswerKeepsTrying) {
  wire->cut();
  routers_.start(kSoonDead);
  openServer();
  caller_.emplace(*dispatcher_);
  routers_.nearRouter().waitUntilSaid("cannot reach");

  wire->mend();

  expectAnswer();
}

// ---- all of this repeatedly

class RouterStormTest : public RouterNetworkTest {
 protected:
  // Records how requests ended, and keeps some requests open.
  void exchange() {
    take();
    while (caller_->isConnected() && caller_->open.size() < 20) {
      numbers_[caller_->send(Int32Message({.value = sent_}))] = sent_;
      ++sent_;
    }
  }
  void take() {
    for (auto message = caller_->take(); message; message = caller_->take()) {
      const auto number = numbers_.at(message.route().requestId);
      if (const auto fate = fateOf(message)) {
        fates_[number] = *fate;
      } else {
        EXPECT_EQ(numberOf(message), number);
        answered_.insert(number);
      }
    }
  }
  void exchangeFor(Nanoseconds time) {
    runUntil([&, until = Deadline::after(time)] {
      exchange();
      return until.hasPassed();
    });
  }
  void exchangeUntilAnswered() {
    runUntil([&, enough = answered_.size() + 100] {
      exchange();
      return answered_.size() >= enough;
    });
  }
  void cutSomehow() {
    const auto way = random_.below(3);
    if (way == 0) return wire->cut();
    wire->cut(way == 1 ? Direction::toFar : Direction::toNear);
  }

  Random random_;
  std::int32_t sent_ = 0;
  std::map<std::uint32_t, std::int32_t> numbers_;  // numbers of open requests, by their ids
  std::set<std::int32_t> answered_;
  std::map<std::int32_t, Fate> fates_;
};

TEST_F(RouterStormTest, NothingIsDeliveredTwiceAndFatesAreTrue) {
  startAll({"--dead-time", "200ms", "--last-retry", "200ms"});
  serveOnceEach();
  wire->behave({.delay = 5ms, .lostPerThousand = 20, .overtakingPerThousand = 100});

  for (int cut = 0; cut < 5; ++cut) {
    exchangeUntilAnswered();
    cutSomehow();
    exchangeFor(std::chrono::milliseconds(random_.below(500)));
    wire->mend();
  }
  exchangeUntilAnswered();
  wire->behave({});
  runUntil([&] {
    take();
    return caller_->open.empty();
  });

  EXPECT_EQ(answered_.size() + fates_.size(), static_cast<std::size_t>(sent_))
      << "each request has one end";
  EXPECT_TRUE(std::ranges::includes(delivered_, answered_));
  for (const auto& [number, fate] : fates_) {
    const bool isTrue = fate == Fate::outcomeUnknown || !delivered_.contains(number);
    EXPECT_TRUE(isTrue) << number << " was delivered, and has the fate " << toString(fate);
  }
}

}  // namespace
}  // namespace mpf::test
