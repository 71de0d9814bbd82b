// SPDX-License-Identifier: MIT
// Routers that are stopped for a while (SIGSTOP): the others close the connection after the dead
// time, all connect again, and nothing is delivered twice.
#include "tests/system/router_fixture.h"

namespace mpf::test {
namespace {

class RouterPauseTest : public RouterTest {
 protected:
  // Sends this number of requests, with unique values.
  void send(int requests) {
    for (int i = 0; i < requests; ++i) caller_->send(Int32Message({.value = --numbered_}));
  }

 private:
  std::int32_t numbered_ = 0;
};

TEST_F(RouterPauseTest, AStoppedRemoteRouterIsDisconnectedAndConnectedAgain) {
  startAll(kSoonDead);
  serveOnceEach();
  for (int round = 0; round < 2; ++round) {
    expectAnswer();
    const auto news = caller_->news.size();

    routers_.farRouter().stop();
    send(10);
    runUntil([&] { return caller_->news.size() >= news + 1; });
    EXPECT_EQ(caller_->messages.size(), 10u);
    for (auto message = caller_->take(); message; message = caller_->take()) {
      EXPECT_THAT(fateOf(message), testing::AnyOf(Fate::outcomeUnknown, Fate::neverTaken));
    }
    routers_.farRouter().resume();

    expectAnswer();
  }
}

// Its clients see that it is alive. When it continues, its connection has been closed.
TEST_F(RouterPauseTest, AStoppedLocalRouterConnectsAgain) {
  startAll(kSoonDead);
  send(1);
  const auto kept = nextRequest();
  serveOnceEach();

  routers_.nearRouter().stop();
  runUntil([&] { return server_->clientOf(kept) == 0; });
  EXPECT_TRUE(caller_->isConnected());
  send(1);
  routers_.nearRouter().resume();

  runUntil([&] { return caller_->news.size() >= 3; });
  EXPECT_THAT(caller_->news,
              testing::ElementsAre(ConnectStatus::connectYes, ConnectStatus::connectNo,
                                   ConnectStatus::connectYes));
  EXPECT_EQ(caller_->messages.size(), 2u);
  for (auto message = caller_->take(); message; message = caller_->take()) {
    EXPECT_THAT(fateOf(message), testing::AnyOf(Fate::outcomeUnknown, Fate::neverTaken));
  }
  expectAnswer();
}

// The far router returns a published message when it has put it into a frame.
TEST_F(RouterPauseTest, AClientIsToldHowManyPublishedMessagesItMissed) {
  startAll(kPatient);
  send(1);
  const auto subscriber = nextRequest();
  const auto publish = [&](std::int32_t number) {
    auto image = server_->allocShared<Int32Array>(1000);
    std::ranges::fill(image.value(), number);
    return server_->publish(image, subscriber);
  };
  EXPECT_EQ(publish(0), ReplyResult::sent);
  EXPECT_EQ(next().getMissed(), 0u);

  routers_.farRouter().stop();
  std::int32_t sent = 0;
  while (publish(++sent) == ReplyResult::sent) {
  }
  for (int dropped = 1; dropped < 10; ++dropped) EXPECT_EQ(publish(-1), ReplyResult::queueFull);
  routers_.farRouter().resume();
  for (std::int32_t number = 1; number < sent; ++number) {
    const auto image = next();
    EXPECT_EQ(image.valueAs<Int32Array>()[0], number);
    EXPECT_EQ(image.getMissed(), 0u);
  }
  EXPECT_EQ(publish(sent), ReplyResult::sent);

  const auto image = next();
  EXPECT_EQ(image.valueAs<Int32Array>()[0], sent);
  EXPECT_EQ(image.getMissed(), 10u);
}

TEST_F(RouterPauseTest, RoutersStoppedForLessThanTheDeadTimeLoseNothing) {
  startAll(kPatient);
  serveOnceEach();
  int answered = 0;
  for (auto* const router : {&routers_.nearRouter(), &routers_.farRouter()}) {
    router->stop();
    send(10);
    router->resume();
    for (int i = 0; i < 10; ++i) EXPECT_EQ(next().tryAs<Int32>()->value, --answered);
  }
  EXPECT_THAT(caller_->news, testing::ElementsAre(ConnectStatus::connectYes));
}

// As when a computer sleeps: whether or not the routers have closed their connection, they work
// again.
TEST_F(RouterPauseTest, RoutersThatWereBothStoppedForLongWorkAgain) {
  startAll({"--dead-time", "300ms"});
  serveOnceEach();
  for (auto* const router : {&routers_.nearRouter(), &routers_.farRouter()}) router->stop();

  runFor(1s);
  for (auto* const router : {&routers_.farRouter(), &routers_.nearRouter()}) router->resume();

  const auto isAnswered = [&] {
    runUntil([&] { return caller_->isConnected(); });
    send(1);
    return !fateOf(next());
  };
  while (!isAnswered()) {
  }
}

}  // namespace
}  // namespace mpf::test
