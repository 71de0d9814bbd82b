// SPDX-License-Identifier: MIT
// Requests without a reply through two routers: each has one fate, and connects and disconnects are
// in order with them.
#include "tests/system/router_fixture.h"

namespace mpf::test {
namespace {

class RouterFatesTest : public RouterTest {
 protected:
  void SetUp() override { startAll(); }
  Fate nextFate(std::uint32_t id) {
    const auto message = next();
    EXPECT_TRUE(RelayClient::endsRequest(message));
    EXPECT_EQ(message.route().requestId, id);
    EXPECT_EQ(message.getClientExtra(), 12) << "a fate carries the client fields of its request";
    return fateOf(message).value();
  }
  std::uint32_t send(Deadline takeBefore = Deadline::never()) {
    Int32Message request({.value = 1});
    request.setClientExtra(12);
    return caller_->send(std::move(request), takeBefore);
  }
};

TEST_F(RouterFatesTest, ARequestThatTheServerRefusesIsRefused) {
  serve_ = [&](Message&& request) { server_->refuse(std::move(request)); };

  EXPECT_EQ(nextFate(send()), Fate::refused);
}

TEST_F(RouterFatesTest, ARequestThatTheServerReleasesIsRefused) {
  serve_ = [](Message&&) {};

  EXPECT_EQ(nextFate(send()), Fate::refused);
}

TEST_F(RouterFatesTest, ARequestExpiresWhenItsServerDoesNotReceiveIt) {
  serverRuns_ = false;

  EXPECT_EQ(nextFate(send(Deadline::after(20ms))), Fate::expired);

  serverRuns_ = true;
  int seen = 0;
  serve_ = [&](Message&& request) {
    ++seen;
    static_cast<void>(server_->reply(std::move(request)));
  };
  caller_->send(Int32Message({.value = 2}), Deadline::after(100s));
  EXPECT_EQ(next().tryAs<Int32>()->value, 2);
  EXPECT_EQ(seen, 1) << "the expired request must not reach the server";
}

// A deadline limits the time until the server receives the request, not the time of its work.
TEST_F(RouterFatesTest, ARequestReceivedInTimeMayBeAnsweredAfterItsDeadline) {
  auto deadline = Deadline::never();
  Message request;
  for (auto time = 100ms; !request;
       time *= 2) {  // doubled until the server receives the request in time
    deadline = Deadline::after(time);
    caller_->send(Int32Message({.value = 1}), deadline);
    while (!request && caller_->messages.empty()) {
      request = server_->receive();
      dispatcher_->runOnce(Deadline::after(200us));
    }
    static_cast<void>(caller_->take());
  }

  runUntil([&] { return deadline.hasPassed(); });
  dispatcher_->runOnce(Deadline::after(1ms));
  EXPECT_EQ(server_->reply(std::move(request)), ReplyResult::sent);

  EXPECT_EQ(next().tryAs<Int32>()->value, 1);
}

TEST_F(RouterFatesTest, ACancelledRequestHasNoOtherEnd) {
  const auto id = send();
  auto request = nextRequest();
  caller_->client.cancel(id);
  EXPECT_EQ(nextFate(id), Fate::cancelled);

  EXPECT_EQ(server_->reply(std::move(request)), ReplyResult::sent);

  caller_->send(Int32Message({.value = 2}));
  EXPECT_EQ(next().tryAs<Int32>()->value, 2) << "the late reply must be dropped";
}

// Requests that the server has received may have been carried out, the others were not. Then the
// disconnect follows, and a connect to the next server.
TEST_F(RouterFatesTest, WhenAServerEndsReceivedRequestsAreUnknownAndOthersNeverTaken) {
  std::vector<std::pair<std::uint32_t, Fate>> expected{{send(), Fate::outcomeUnknown},
                                                       {send(), Fate::outcomeUnknown}};
  const auto first = nextRequest();
  const auto second = nextRequest();
  serverRuns_ = false;
  for (int i = 0; i < 5; ++i) expected.emplace_back(send(), Fate::neverTaken);
  EXPECT_EQ(nextFate(send(Deadline::after(1ms))), Fate::expired) << "the others have arrived, too";

  server_.reset();

  for (const auto& [id, fate] : expected) EXPECT_EQ(nextFate(id), fate);
  runUntil([&] { return !caller_->isConnected(); });
  EXPECT_THAT(caller_->news,
              testing::ElementsAre(ConnectStatus::connectYes, ConnectStatus::connectNo));
  EXPECT_THAT(caller_->messages, testing::IsEmpty());
  serverRuns_ = true;
  openServer();
  runUntil([&] { return caller_->isConnected(); });
  caller_->send(Int32Message({.value = 9}));
  EXPECT_EQ(next().tryAs<Int32>()->value, 9);
}

// The server has accepted no client of the remote router yet.
TEST_F(RouterFatesTest, AServerThatEndsBeforeItAcceptsAClientReceivesNothing) {
  serverRuns_ = false;
  Caller late(*dispatcher_);
  runUntil([&] { return late.isConnected(); });
  const auto id = late.send(Int32Message());

  server_.reset();

  runUntil([&] { return late.news.size() == 2; });
  EXPECT_THAT(late.news, testing::ElementsAre(ConnectStatus::connectYes, ConnectStatus::connectNo));
  ASSERT_EQ(late.messages.size(), 1u);
  EXPECT_EQ(late.messages.front().route().requestId, id);
  EXPECT_EQ(fateOf(late.take()), Fate::neverTaken);
}

// The queue has the size of the server's queue. The client gets the refusals and is notified once
// that the queue is full.
TEST_F(RouterFatesTest, AFullQueueRefusesAndIsReportedOnceInOrder) {
  constexpr int kQueueSize = 10;
  restartServer({.queueSize = kQueueSize});
  serverRuns_ = false;

  for (int i = 0; i < kQueueSize; ++i) send();
  waitUntilTaken("echo", kQueueSize);
  for (int i = 0; i < kQueueSize; ++i) EXPECT_EQ(nextFate(send()), Fate::refused);

  runUntil([&] { return caller_->news.size() == 1; });
  EXPECT_THAT(caller_->news, testing::ElementsAre(ConnectStatus::connectQueueFull));
  serverRuns_ = true;
  for (int i = 0; i < kQueueSize; ++i) EXPECT_EQ(next().tryAs<Int32>()->value, 1);
  caller_->send(Int32Message({.value = 9}));
  EXPECT_EQ(next().tryAs<Int32>()->value, 9);
  EXPECT_EQ(caller_->news.size(), 1u) << "no notification since";
}

// Each server begins with a connect and ends with a disconnect; the fixture checks the ends of
// requests.
TEST_F(RouterFatesTest, EachServerBeginsWithAConnectAndEndsWithADisconnect) {
  constexpr int kLives = 20;
  std::vector<ConnectStatus> expected{ConnectStatus::connectYes};
  for (int life = 0; life < kLives; ++life) {
    for (int i = 0; i < kLives; ++i) send();
    for (int answered = 0; answered < life; ++answered)
      static_cast<void>(server_->reply(nextRequest()));
    serverRuns_ = false;
    server_.reset();
    expected.push_back(ConnectStatus::connectNo);
    runUntil([&] { return caller_->news.size() == expected.size(); });

    serverRuns_ = true;
    openServer();
    expected.push_back(ConnectStatus::connectYes);
    runUntil([&] { return caller_->news.size() == expected.size(); });
  }
  EXPECT_EQ(caller_->news, expected);
  EXPECT_EQ(caller_->messages.size(), std::size_t{kLives} * kLives);
}

}  // namespace
}  // namespace mpf::test
