// SPDX-License-Identifier: MIT
// Exceptions that leave callbacks of clients and handlers of servers: they leave the call that runs
// the callback, no request is lost, and the next call continues.
#include <poll.h>

#include <atomic>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "tests/client/client_fixture.h"
#include "tests/support/log_lines.h"

namespace mpf::test {
namespace {

struct Thrown : std::runtime_error {
  Thrown() : std::runtime_error("thrown by a test") {}
};

class CallbackErrorTest : public ClientTest {
 protected:
  // A client whose callback records each message and then throws, if `mayThrow` is set.
  MessageClient& makeThrower(std::function<bool(const Message&)> mayThrow) {
    thrower_ =
        std::make_unique<MessageClient>(dispatcher_, [this, mayThrow](const Message& message) {
          if (const auto* connect = message.tryAs<Connect>()) {
            told_.push_back(toString(connect->status));
          } else if (const auto fate = fateOf(message)) {
            told_.emplace_back(toString(*fate));
          } else {
            told_.emplace_back("reply");
          }
          if (mayThrow(message)) throw Thrown();
        });
    thrower_->bind("device[0]/a");
    return *thrower_;
  }
  template <class Condition>
  void runCatching(Condition condition) {
    while (!condition()) {
      try {
        runUntil(condition);
      } catch (const Thrown&) {
        ++caught_;
      }
    }
  }
  // Receives that many requests of the client that throws, and keeps them.
  void holdRequests(MessageClient& client, std::size_t requests) {
    server_->on<Int32>([this](Int32Message&& request) { held_.push_back(std::move(request)); });
    runCatching([&] { return client.isConnected(); });
    for (std::size_t i = 0; i < requests; ++i) {
      std::uint32_t id = 0;
      ASSERT_EQ(client.send(Int32Message(), deadline_, &id), SendResult::sent);
      ids_.push_back(id);
    }
    if (serverRuns_) runCatching([&] { return held_.size() == requests; });
  }
  void TearDown() override {
    thrower_.reset();
    held_.clear();
    ClientTest::TearDown();
  }
  static std::string toString(ConnectStatus status) {
    switch (status) {
      case ConnectStatus::connectYes:
        return "connectYes";
      case ConnectStatus::connectNo:
        return "connectNo";
      case ConnectStatus::connectRefused:
        return "connectRefused";
      case ConnectStatus::connectQueueFull:
        return "connectQueueFull";
    }
    return "?";
  }
  static std::string toString(Fate fate) { return std::string(mpf::toString(fate)); }

  std::unique_ptr<MessageClient> thrower_;
  std::vector<std::string> told_;
  std::vector<Message> held_;
  std::vector<std::uint32_t> ids_;
  Deadline deadline_ = Deadline::never();
  int caught_ = 0;
};

bool always(const Message&) { return true; }
bool atFates(const Message& message) { return message.tryAs<RequestFate>() != nullptr; }

// ---- clients

TEST_F(CallbackErrorTest, EachRequestOfADisconnectGetsItsFateAndTheClientReconnects) {
  startServer();
  auto& client = makeThrower(always);
  holdRequests(client, 5);

  server_.reset();
  startServer();
  runCatching([&] { return told_.size() == 8; });

  const auto unknown = toString(Fate::outcomeUnknown);
  EXPECT_THAT(told_, testing::ElementsAre("connectYes", unknown, unknown, unknown, unknown, unknown,
                                          "connectNo", "connectYes"));
  EXPECT_EQ(caught_, 8);
  EXPECT_TRUE(client.isConnected());
}

// The replies that the server sent before it ended are delivered first, one by one.
TEST_F(CallbackErrorTest, RepliesOfAServerThatEndedAreNotLost) {
  startServer();
  auto& client = makeThrower(always);
  holdRequests(client, 3);
  for (auto& request : held_) ASSERT_EQ(server_->reply(std::move(request)), ReplyResult::sent);
  ASSERT_EQ(client.send(Int32Message()), SendResult::sent);

  server_.reset();
  runCatching([&] { return told_.back() == "connectNo"; });

  EXPECT_THAT(told_, testing::ElementsAre("connectYes", "reply", "reply", "reply",
                                          toString(Fate::neverTaken), "connectNo"));
  EXPECT_EQ(caught_, 6);
}

TEST_F(CallbackErrorTest, RepliesAfterTheOneWhoseCallbackThrewArrive) {
  startServer();
  auto& client = makeThrower(always);
  holdRequests(client, 20);
  for (auto& request : held_) ASSERT_EQ(server_->reply(std::move(request)), ReplyResult::sent);

  runCatching([&] { return told_.size() == 21; });

  EXPECT_EQ(caught_, 21);
}

TEST_F(CallbackErrorTest, EachCancelledRequestGetsItsFate) {
  startServer();
  auto& client = makeThrower(atFates);
  holdRequests(client, 3);

  for (const auto id : ids_) client.cancel(id);
  runCatching([&] { return caught_ == 3; });

  const auto cancelled = toString(Fate::cancelled);
  EXPECT_THAT(told_, testing::ElementsAre("connectYes", cancelled, cancelled, cancelled));
}

TEST_F(CallbackErrorTest, EachExpiredRequestGetsItsFate) {
  startServer();
  auto& client = makeThrower(atFates);
  runCatching([&] { return client.isConnected(); });
  serverRuns_ = false;
  deadline_ = Deadline::after(2ms);
  holdRequests(client, 3);

  runCatching([&] { return caught_ == 3; });

  const auto expired = toString(Fate::expired);
  EXPECT_THAT(told_, testing::ElementsAre("connectYes", expired, expired, expired));
}

// A client may be destroyed before its callback has received all fates.
TEST_F(CallbackErrorTest, AClientMayBeDestroyedAfterAnExceptionInItsDisconnect) {
  startServer();
  auto& client = makeThrower(atFates);
  holdRequests(client, 3);
  server_.reset();
  runCatching([&] { return caught_ == 1; });

  thrower_.reset();

  while (dispatcher_.runOnce(Deadline::after(1ms))) {
  }
  EXPECT_EQ(told_.size(), 2u);
  EXPECT_EQ(countNames(backplane_, NameKind::link), 0);
}

// Other clients of the dispatcher are not affected.
TEST_F(CallbackErrorTest, OtherClientsGetTheirDisconnects) {
  startServer();
  client_.bind("device[0]/a");
  auto& client = makeThrower(always);
  holdRequests(client, 1);
  runCatching([&] { return client_.isConnected(); });

  server_.reset();
  runCatching([&] { return told_.size() == 3 && news_.size() == 2; });

  EXPECT_THAT(news_, testing::ElementsAre(ConnectStatus::connectYes, ConnectStatus::connectNo));
}

TEST_F(CallbackErrorTest, TheDescriptorOfADispatcherStaysReadableAfterAnException) {
  startServer();
  auto& client =
      makeThrower([](const Message& message) { return message.tryAs<Connect>() == nullptr; });
  pollfd fd{dispatcher_.descriptor(), POLLIN, 0};
  holdRequests(client, 2);
  while (!dispatcher_.runPending()) {
  }
  for (auto& request : held_) ASSERT_EQ(server_->reply(std::move(request)), ReplyResult::sent);

  for (int replies = 0; replies < 2; ++replies) {
    ASSERT_EQ(::poll(&fd, 1, -1), 1);
    EXPECT_THROW(dispatcher_.runPending(), Thrown);
  }

  EXPECT_THAT(told_, testing::ElementsAre("connectYes", "reply", "reply"));
}

TEST_F(CallbackErrorTest, AnExceptionLeavesAWaitForAConnection) {
  startServer();
  std::thread serving([&] { server_->run(); });
  auto& client = makeThrower(always);

  EXPECT_THROW(static_cast<void>(client.connectWait(100s)), Thrown);
  EXPECT_TRUE(client.connectWait(100s));

  server_->interrupt();
  serving.join();
}

// That thread has no caller that could handle it: each exception is counted, and the lines on
// stderr stand for all of them.
TEST_F(CallbackErrorTest, ASharedDispatcherReportsTheExceptionAndContinues) {
  constexpr int kRequests = 1000;
  startServer().on<Int32>([](Int32&) {});
  std::thread serving([&] { server_->run(); });
  std::atomic<int> replies{0};
  testing::internal::CaptureStderr();
  {
    MessageClient client(backplane_, [&](const Message& message) {
      if (message.tryAs<Int32>() == nullptr) return;
      ++replies;
      throw Thrown();
    });
    client.bind("device[0]/a");
    EXPECT_TRUE(client.connectWait(100s));
    for (int i = 0; i < kRequests; ++i) {
      while (client.send(Int32Message()) != SendResult::sent) std::this_thread::yield();
    }

    while (sumOf(&layout::WindowControl::alarms) != kRequests) std::this_thread::yield();
  }
  const auto written = testing::internal::GetCapturedStderr();

  EXPECT_EQ(replies, kRequests);
  const auto lines = countLines(
      written,
      "the client of server \"device[0]/a\" at location 0 threw an exception: thrown by a test");
  EXPECT_EQ(lines.meant, kRequests) << written;
  EXPECT_LE(lines.written, lines.meant / 2) << written;
  EXPECT_EQ(lines.all, lines.written) << written;
  server_->interrupt();
  serving.join();
}

// ---- servers

TEST_F(CallbackErrorTest, ARequestWhoseHandlerThrowsIsRefusedAndTheServerContinues) {
  auto& server = startServer();
  int handled = 0;
  const auto throwFirst = [&] {
    if (++handled % 2 == 1) throw Thrown();
  };
  server.on<Int32>([&](Int32&) { throwFirst(); });
  server.on<Float64>([&](Float64Message&) { throwFirst(); });
  server.on<OutOfBand>([&](OutOfBandMessage&& request) {
    const auto owned = std::move(request);
    throwFirst();
  });
  bind();
  const auto sendTwice = [&](auto make) {
    for (int i = 0; i < 2; ++i) ASSERT_EQ(client_.send(make()), SendResult::sent);
  };
  sendTwice([] { return Int32Message(); });
  sendTwice([] { return Float64Message(); });
  sendTwice([] { return OutOfBandMessage(); });

  int thrown = 0;
  while (handled < 6) {
    try {
      server.handleOne();
    } catch (const Thrown&) {
      ++thrown;
    }
  }

  EXPECT_EQ(thrown, 3);
  EXPECT_EQ(fateOf(next()), Fate::refused);
  EXPECT_NE(next().tryAs<Int32>(), nullptr);
  EXPECT_EQ(fateOf(next()), Fate::refused);
  EXPECT_NE(next().tryAs<Float64>(), nullptr);
  EXPECT_EQ(fateOf(next()), Fate::refused);
  EXPECT_EQ(fateOf(next()), Fate::refused) << "that handler sends no reply";
}

TEST_F(CallbackErrorTest, AnExceptionOfAHandlerLeavesRunWhichMayBeCalledAgain) {
  auto& server = startServer();
  int handled = 0;
  server.on<Int32>([&](Int32&) {
    if (++handled == 1) throw Thrown();
    server.interrupt();
  });
  bind();
  for (int i = 0; i < 2; ++i) ASSERT_EQ(client_.send(Int32Message()), SendResult::sent);

  EXPECT_THROW(server.run(), Thrown);
  server.run();

  EXPECT_EQ(fateOf(next()), Fate::refused);
  EXPECT_NE(next().tryAs<Int32>(), nullptr);
}

TEST_F(CallbackErrorTest, TheDescriptorOfAServerStaysReadableAfterAnException) {
  auto& server = startServer();
  int handled = 0;
  server.on<Int32>([&](Int32&) {
    ++handled;
    throw Thrown();
  });
  bind();
  pollfd fd{server.descriptor(), POLLIN, 0};
  while (server.handleOne()) {
  }
  for (int i = 0; i < 2; ++i) ASSERT_EQ(client_.send(Int32Message()), SendResult::sent);

  while (handled < 2) {
    ASSERT_EQ(::poll(&fd, 1, -1), 1);
    EXPECT_THROW(while (server.handleOne()){}, Thrown);
  }

  EXPECT_EQ(fateOf(next()), Fate::refused);
  EXPECT_EQ(fateOf(next()), Fate::refused);
}

TEST_F(CallbackErrorTest, EachConnectAndDisconnectIsReportedAlthoughCallbacksThrow) {
  auto& server = startServer();
  std::vector<bool> news;
  server.onClient([&](std::uint64_t, bool isThere) {
    news.push_back(isThere);
    throw Thrown();
  });
  server.on<Int32>([](Int32&) {});
  auto another = std::make_unique<MessageClient>(dispatcher_, [](const Message&) {});
  another->bind("device[0]/a");
  client_.bind("device[0]/a");

  runCatching([&] { return client_.isConnected() && another->isConnected(); });
  ASSERT_EQ(another->send(Int32Message()), SendResult::sent);
  ASSERT_EQ(client_.send(Int32Message()), SendResult::sent);
  another.reset();
  runCatching([&] { return !messages_.empty() && caught_ == 3; });

  EXPECT_THAT(news, testing::ElementsAre(true, true, false));
  EXPECT_NE(next().tryAs<Int32>(), nullptr);
  EXPECT_EQ(protocolErrors(), 0u);
}

}  // namespace
}  // namespace mpf::test
