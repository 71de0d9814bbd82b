// SPDX-License-Identifier: MIT
#include "epics/shared_client.h"

#include <mutex>
#include <optional>
#include <thread>

#include "tests/epics/epics_fixture.h"

namespace mpf::test {
namespace {

// Records what it gets; any thread.
class RecordingMember final : public SharedClient::Member {
 public:
  void deliver(Message&& message) noexcept override {
    const std::lock_guard lock(mutex_);
    messages_.push_back(std::move(message));
  }
  // Waits for the next message.
  Message next() {
    for (;; std::this_thread::yield()) {
      const std::lock_guard lock(mutex_);
      if (messages_.empty()) continue;
      auto message = std::move(messages_.front());
      messages_.pop_front();
      return message;
    }
  }
  bool isEmpty() {
    const std::lock_guard lock(mutex_);
    return messages_.empty();
  }
  void expectConnect(ConnectStatus status) {
    const auto message = next();
    const auto* connect = message.tryAs<Connect>();
    ASSERT_NE(connect, nullptr);
    EXPECT_EQ(connect->status, status);
  }

 private:
  std::mutex mutex_;
  std::deque<Message> messages_;
};

class SharedClientTest : public testing::Test {
 protected:
  SendResult send(std::uint32_t member, std::int32_t value, Deadline deadline = Deadline::never()) {
    return client_.send(member, replyTypeCompleteIO, Int32Message({.value = value}), deadline,
                        requestId_);
  }
  // Receives the next request.
  static Message receive(MessageServer& server) {
    Message request;
    while (!(request = server.receive())) server.waitForMessage();
    return request;
  }
  static std::int32_t valueOf(const Message& message) {
    const auto* fields = message.tryAs<Int32>();
    return fields == nullptr ? -1 : fields->value;
  }

  const Watchdog watchdog_{"SharedClient"};
  TestBackplane backplane_;
  RecordingMember one_, two_;
  std::atomic<std::uint32_t> requestId_{0};
  const std::shared_ptr<Dispatcher> dispatcher_ = Dispatcher::shared(backplane_);
  SharedClient client_{*dispatcher_, "s", 0};
};

TEST_F(SharedClientTest, AMemberThatIsAddedLaterIsNotifiedOfTheConnection) {
  std::optional<ThreadServer> server(std::in_place, backplane_, "s",
                                     [](MessageServer&, Message&&) {});
  static_cast<void>(client_.add(one_));
  client_.bind();
  one_.expectConnect(ConnectStatus::connectYes);

  static_cast<void>(client_.add(two_));
  two_.expectConnect(ConnectStatus::connectYes);

  server.reset();
  one_.expectConnect(ConnectStatus::connectNo);
  two_.expectConnect(ConnectStatus::connectNo);
}

TEST_F(SharedClientTest, AReplyReachesTheMemberThatSentTheRequest) {
  const ThreadServer server(backplane_, "s", [](MessageServer& self, Message&& request) {
    static_cast<void>(self.reply(std::move(request)));
  });
  const auto one = client_.add(one_);
  const auto two = client_.add(two_);
  client_.bind();
  one_.expectConnect(ConnectStatus::connectYes);
  two_.expectConnect(ConnectStatus::connectYes);

  EXPECT_EQ(send(two, 2), SendResult::sent);
  EXPECT_EQ(send(one, 1), SendResult::sent);

  const auto reply = two_.next();
  EXPECT_EQ(valueOf(reply), 2);
  EXPECT_EQ(SharedClient::replyTypeOf(reply), replyTypeCompleteIO);
  EXPECT_EQ(valueOf(one_.next()), 1);
}

// Otherwise the record that sent the request would wait for its end for ever.
TEST_F(SharedClientTest, AReplyWithTheClientTypeOfAnotherMemberReachesTheSender) {
  const ThreadServer server(backplane_, "s", [](MessageServer& self, Message&& request) {
    constexpr std::int32_t kOtherMember = 1 << 2;
    request.setClientType((request.getClientType() ^ kOtherMember) & ~3);
    static_cast<void>(self.reply(std::move(request)));
  });
  const auto one = client_.add(one_);
  static_cast<void>(client_.add(two_));
  client_.bind();
  one_.expectConnect(ConnectStatus::connectYes);
  two_.expectConnect(ConnectStatus::connectYes);

  EXPECT_EQ(send(one, 1), SendResult::sent);

  while (one_.isEmpty() && two_.isEmpty()) std::this_thread::yield();
  ASSERT_FALSE(one_.isEmpty());
  const auto reply = one_.next();
  EXPECT_EQ(valueOf(reply), 1);
  EXPECT_EQ(SharedClient::replyTypeOf(reply), replyTypeCompleteIO);
}

TEST_F(SharedClientTest, RequestsThatDoNotFitTheQueueWaitInOrder) {
  MessageServer server(backplane_, "s", {.queueSize = 2});
  const auto one = client_.add(one_);
  client_.bind();
  while (!client_.isConnected()) {
    server.waitForMessage(Deadline::after(std::chrono::milliseconds(1)));
    ASSERT_FALSE(server.receive());
  }
  one_.expectConnect(ConnectStatus::connectYes);
  constexpr int kRequests = 20;

  for (int value = 0; value < kRequests; ++value) EXPECT_EQ(send(one, value), SendResult::sent);

  for (int value = 0; value < kRequests; ++value) {
    EXPECT_EQ(server.reply(receive(server)), ReplyResult::sent);
    EXPECT_EQ(valueOf(one_.next()), value);
    client_.serveBacklog();
  }
}

TEST_F(SharedClientTest, RequestsThatWaitTooLongExpire) {
  MessageServer server(backplane_, "s", {.queueSize = 1});
  const auto one = client_.add(one_);
  client_.bind();
  while (!client_.isConnected()) {
    server.waitForMessage(Deadline::after(std::chrono::milliseconds(1)));
    ASSERT_FALSE(server.receive());
  }
  one_.expectConnect(ConnectStatus::connectYes);
  constexpr int kRequests = 10;
  const auto deadline = Deadline::after(std::chrono::milliseconds(100));
  for (int value = 0; value < kRequests; ++value)
    EXPECT_EQ(send(one, value, deadline), SendResult::sent);

  while (!deadline.hasPassed()) std::this_thread::yield();
  client_.serveBacklog();

  for (int value = 0; value < kRequests; ++value) {
    const auto message = one_.next();
    ASSERT_NE(message.tryAs<RequestFate>(), nullptr) << value;
    EXPECT_EQ(message.tryAs<RequestFate>()->fate, Fate::expired);
  }
}

// It would be refused only after those before it.
TEST_F(SharedClientTest, ARequestThatIsTooLargeDoesNotWaitForTheQueue) {
  MessageServer server(backplane_, "s", {.queueSize = 1, .maxMessageBytes = 65'536});
  const auto one = client_.add(one_);
  client_.bind();
  while (!client_.isConnected()) {
    server.waitForMessage(Deadline::after(std::chrono::milliseconds(1)));
    ASSERT_FALSE(server.receive());
  }
  constexpr int kRequests = 5;
  for (int value = 0; value < kRequests; ++value) EXPECT_EQ(send(one, value), SendResult::sent);

  EXPECT_EQ(client_.send(one, replyTypeCompleteIO, Char8ArrayMessage::allocValue(100'000),
                         Deadline::never(), requestId_),
            SendResult::tooLarge);
}

TEST_F(SharedClientTest, ARequestExpiresBehindOneWithoutATimeLimit) {
  MessageServer server(backplane_, "s", {.queueSize = 1});
  const auto one = client_.add(one_);
  const auto two = client_.add(two_);
  client_.bind();
  while (!client_.isConnected()) {
    server.waitForMessage(Deadline::after(std::chrono::milliseconds(1)));
    ASSERT_FALSE(server.receive());
  }
  one_.expectConnect(ConnectStatus::connectYes);
  two_.expectConnect(ConnectStatus::connectYes);
  constexpr int kRequests = 5;
  for (int value = 0; value < kRequests; ++value) EXPECT_EQ(send(one, value), SendResult::sent);
  const auto deadline = Deadline::after(std::chrono::milliseconds(10));
  EXPECT_EQ(send(two, kRequests, deadline), SendResult::sent);

  while (!deadline.hasPassed()) std::this_thread::yield();
  client_.serveBacklog();

  const auto message = two_.next();
  ASSERT_NE(message.tryAs<RequestFate>(), nullptr);
  EXPECT_EQ(message.tryAs<RequestFate>()->fate, Fate::expired);
  for (int value = 0; value < kRequests; ++value) {
    EXPECT_EQ(server.reply(receive(server)), ReplyResult::sent);
    EXPECT_EQ(valueOf(one_.next()), value);
    client_.serveBacklog();
  }
}

}  // namespace
}  // namespace mpf::test
