// SPDX-License-Identifier: MIT
// Full queues: messages are refused immediately, counted, and reported in order; no message is
// lost, and other clients are not affected.
#include <algorithm>
#include <numeric>
#include <string>

#include "shm/window.h"
#include "tests/client/client_fixture.h"

namespace mpf::test {
namespace {

class QueueTest : public ClientTest {
 protected:
  // A second client of the same server, with its own dispatcher.
  struct Other {
    explicit Other(const Backplane& backplane) : dispatcher(backplane) {
      client.bind("device[0]/a");
    }
    Dispatcher dispatcher;
    std::vector<std::int32_t> replies;
    MessageClient client{dispatcher, [this](const Message& message) {
                           if (const auto* reply = message.tryAs<Int32>())
                             replies.push_back(reply->value);
                         }};
  };
  template <class Condition>
  void runWith(Other& other, Condition condition) {
    runUntil([&] {
      other.dispatcher.runOnce(Deadline::atNs(0));
      return condition();
    });
  }
  SendResult send(std::int32_t value) { return client_.send(Int32Message({.value = value})); }
  // The public part of the window of the only server or of the only dispatcher.
  const layout::WindowControl& control(layout::SegmentKind kind) {
    const auto* mark = kind == layout::SegmentKind::serverWindow ? ".s." : ".c.";
    for (const auto& name : backplane_.segmentNames()) {
      if (name.find(mark) != std::string::npos) window_ = PeerWindow::tryOpen(name, kind);
    }
    return window_->control();
  }
  std::vector<std::int32_t> nextValues(int count) {
    std::vector<std::int32_t> values;
    for (int i = 0; i < count; ++i) values.push_back(next().tryAs<Int32>()->value);
    return values;
  }
  static std::vector<std::int32_t> numbers(std::size_t count) {
    std::vector<std::int32_t> all(count);
    std::iota(all.begin(), all.end(), 0);
    return all;
  }

 private:
  std::shared_ptr<PeerWindow> window_;
};

TEST_F(QueueTest, EachRefusalIsCountedInTheClientsWindow) {
  startServer({.queueSize = 5}).on<Int32>([](Int32&) {});
  bind();
  serverRuns_ = false;
  const auto& counters = control(layout::SegmentKind::clientWindow);
  for (int i = 0; i < 5; ++i) ASSERT_EQ(send(i), SendResult::sent);
  EXPECT_EQ(counters.queueFull.load(), 0u);

  for (int i = 0; i < 3; ++i) EXPECT_EQ(send(5), SendResult::queueFull);

  EXPECT_EQ(counters.queueFull.load(), 3u);
  serverRuns_ = true;
  EXPECT_EQ(nextValues(5), numbers(5));
}

TEST_F(QueueTest, RequestsWithoutReplyHaveALimitAndRefusalsAreCounted) {
  auto& server = startServer({.queueSize = 5});
  std::vector<Message> held;
  server.on<Int32>([&](Int32Message&& request) { held.push_back(std::move(request)); });
  bind();
  std::size_t sent = 0;
  while (send(static_cast<std::int32_t>(sent)) == SendResult::sent)
    runUntil([&, before = sent++] { return held.size() > before; });

  EXPECT_EQ(send(0), SendResult::tooManyOutstanding);

  EXPECT_EQ(sent, 10u);
  EXPECT_EQ(control(layout::SegmentKind::clientWindow).queueFull.load(), 2u);
  for (auto& request : held) EXPECT_EQ(server.reply(std::move(request)), ReplyResult::sent);
  EXPECT_EQ(nextValues(10), numbers(10));
  EXPECT_EQ(send(7), SendResult::sent);
  runUntil([&] { return held.size() == 11; });
  EXPECT_EQ(server.reply(std::move(held.back())), ReplyResult::sent);
  EXPECT_EQ(nextValues(1).front(), 7);
}

TEST_F(QueueTest, ARefusedArrayStaysWithTheCallerAndCanBeSentLater) {
  startServer({.queueSize = 1}).on<Float64Array>([](Float64ArrayMessage&) {});
  bind();
  serverRuns_ = false;
  ASSERT_EQ(client_.send(client_.alloc<Float64Array>(1)), SendResult::sent);
  auto large = client_.alloc<Float64Array>(5000);
  large.value()[4999] = 0.5;

  ASSERT_EQ(client_.send(std::move(large)), SendResult::queueFull);

  serverRuns_ = true;
  EXPECT_EQ(next().valueAs<Float64Array>().size(), 1u);
  ASSERT_EQ(client_.send(std::move(large)), SendResult::sent);
  EXPECT_EQ(next().valueAs<Float64Array>()[4999], 0.5);
}

TEST_F(QueueTest, EachSeriesOfRefusalsIsReportedOnceAndInOrder) {
  startServer({.queueSize = 2}).on<Int32>([](Int32&) {});
  bind();
  for (std::size_t run = 1; run <= 3; ++run) {
    serverRuns_ = false;
    ASSERT_EQ(send(0), SendResult::sent);
    ASSERT_EQ(send(1), SendResult::sent);
    EXPECT_EQ(send(2), SendResult::queueFull);
    EXPECT_EQ(send(2), SendResult::queueFull);
    runUntil([&] { return news_.size() == 1 + run; });
    EXPECT_THAT(messages_, testing::IsEmpty()) << "the refusal is delivered before later replies";
    serverRuns_ = true;
    EXPECT_EQ(nextValues(2), numbers(2));
  }

  server_.reset();
  runUntil([&] { return !client_.isConnected(); });

  EXPECT_THAT(news_,
              testing::ElementsAre(ConnectStatus::connectYes, ConnectStatus::connectQueueFull,
                                   ConnectStatus::connectQueueFull, ConnectStatus::connectQueueFull,
                                   ConnectStatus::connectNo));
}

TEST_F(QueueTest, ANewQueueSizeAppliesToLaterClients) {
  auto& server = startServer({.queueSize = 5});
  server.on<Int32>([](Int32&) {});
  bind();

  server.setQueueSize(2);

  Other later(backplane_);
  runWith(later, [&] { return later.client.isConnected(); });
  for (int i = 0; i < 2; ++i)
    EXPECT_EQ(later.client.send(Int32Message({.value = i})), SendResult::sent);
  EXPECT_EQ(later.client.send(Int32Message()), SendResult::queueFull);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(send(i), SendResult::sent);
  EXPECT_EQ(send(5), SendResult::queueFull);
  EXPECT_EQ(nextValues(5), numbers(5));
  runWith(later, [&] { return later.replies.size() == 2; });
  EXPECT_EQ(later.replies, numbers(2));
}

TEST_F(QueueTest, AQueueSizeOutsideTheLimitsIsAnError) {
  auto& server = startServer();

  EXPECT_THROW(server.setQueueSize(0), std::invalid_argument);
  EXPECT_THROW(server.setQueueSize(16385), std::invalid_argument);
  EXPECT_THROW(MessageServer(backplane_, "another", {.queueSize = -1}), std::invalid_argument);
  EXPECT_NO_THROW(server.setQueueSize(16384));
}

TEST_F(QueueTest, RepliesThatAClientDoesNotReceiveAreRefusedAndCountedAndOthersAreNotAffected) {
  auto& server = startServer({.queueSize = 8});
  Message held;
  server.on<Int32>([&](Int32Message&& request) {
    if (request->cmd == 1) {
      held = std::move(request);
    } else {
      EXPECT_EQ(server.reply(std::move(request)), ReplyResult::sent)
          << "a first reply always has room";
    }
  });
  bind();
  ASSERT_EQ(client_.send(Int32Message({.cmd = 1})), SendResult::sent);
  runUntil([&] { return static_cast<bool>(held); });
  const auto& counters = control(layout::SegmentKind::serverWindow);
  std::int32_t sent = 0;
  const auto stream = [&] {
    auto change = server.allocReplyMessage<Int32>(held);
    change->value = sent;
    return server.reply(std::move(change));
  };

  while (stream() == ReplyResult::sent) ++sent;

  EXPECT_EQ(stream(), ReplyResult::queueFull);
  EXPECT_EQ(counters.replyQueueFull.load(), 2u);
  // The client receives nothing, but sends.
  for (int i = 0; i < 8; ++i) EXPECT_EQ(send(i), SendResult::sent);
  Other other(backplane_);
  while (other.replies.size() < 20) {
    static_cast<void>(server.handleOne());
    other.dispatcher.runOnce(Deadline::atNs(0));
    if (other.client.isConnected()) static_cast<void>(other.client.send(Int32Message()));
  }
  while (server.handleOne()) {
  }
  EXPECT_EQ(counters.replyQueueFull.load(), 2u);
  // Now it receives all replies.
  EXPECT_EQ(nextValues(sent), numbers(static_cast<std::size_t>(sent)));
  EXPECT_EQ(nextValues(8), numbers(8));
  EXPECT_EQ(stream(), ReplyResult::sent);
  EXPECT_EQ(nextValues(1).front(), sent);
}

// More clients than the server polls: clients that were silent for a long time have their turn,
// too.
TEST_F(QueueTest, AFullQueueOfOneClientDoesNotDelayOthers) {
  auto& server = startServer({.queueSize = 1000});
  std::vector<std::int32_t> order;
  server.on<Int32>([&](Int32& request) { order.push_back(request.address); });
  bind();
  std::vector<std::unique_ptr<Other>> others;
  for (int i = 0; i < 12; ++i) {
    others.push_back(std::make_unique<Other>(backplane_));
    runWith(*others.back(), [&] { return others.back()->client.isConnected(); });
  }
  serverRuns_ = false;
  while (client_.send(Int32Message({.address = 1})) == SendResult::sent) {
  }

  for (const auto& other : others)
    ASSERT_EQ(other->client.send(Int32Message({.address = 2})), SendResult::sent);

  while (server.handleOne()) {
  }
  ASSERT_EQ(order.size(), 1000 + others.size());
  EXPECT_LT(order.rend() - std::find(order.rbegin(), order.rend(), 2), 500) << "clients take turns";
  for (int i = 0; i < 1000; ++i) EXPECT_NE(next().tryAs<Int32>(), nullptr);
}

TEST_F(QueueTest, MessagesSentAgainAfterRefusalsArriveInOrder) {
  startServer({.queueSize = 3}).on<Int32>([](Int32&) {});
  bind();
  serverRuns_ = false;
  std::int32_t sent = 0;
  std::int32_t refused = 0;

  while (sent < 1000) {
    if (send(sent) == SendResult::sent) {
      ++sent;
    } else if (++refused % 2 == 0) {
      dispatcher_.runOnce(Deadline::atNs(0));
    } else {
      static_cast<void>(server_->handleOne());
    }
  }

  serverRuns_ = true;
  EXPECT_EQ(nextValues(1000), numbers(1000));
  EXPECT_GT(refused, 300);
}

}  // namespace
}  // namespace mpf::test
