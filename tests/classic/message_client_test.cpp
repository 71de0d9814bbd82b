// SPDX-License-Identifier: MIT
// Clients of the original API with servers of the new one.
#include <condition_variable>
#include <cstring>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>

#include <mpf/dispatcher.h>
#include <mpf/message_server.h>

#include "tests/classic/classic_fixture.h"

namespace mpf::test {
namespace {

// A client that keeps what its callback gets.
class Receiver {
 public:
  Receiver() : client_(onMessage, this) {}
  ::MessageClient& client() { return client_; }
  // Waits for the next message.
  std::unique_ptr<::Message> next() {
    std::unique_lock lock(mutex_);
    came_.wait(lock, [this] { return !messages_.empty(); });
    auto message = std::move(messages_.front());
    messages_.pop_front();
    return message;
  }
  int nextStatus() {
    const auto message = next();
    const auto* fields = dynamic_cast<const StandardFieldsMessage*>(message.get());
    return fields != nullptr ? fields->status : 99;
  }
  int nextConnectStatus() {
    const auto message = next();
    const auto* connect = dynamic_cast<const ::ConnectMessage*>(message.get());
    return connect != nullptr ? connect->status : 99;
  }

 private:
  static void onMessage(::Message* message, void* self) {
    auto& receiver = *static_cast<Receiver*>(self);
    const std::lock_guard lock(receiver.mutex_);
    receiver.messages_.emplace_back(message);
    receiver.came_.notify_one();
  }
  std::mutex mutex_;
  std::condition_variable came_;
  std::deque<std::unique_ptr<::Message>> messages_;
  ::MessageClient client_;  // last: its callback uses the other members
};

class ClassicClientTest : public ClassicTest {
 protected:
  void connect() {
    ASSERT_EQ(receiver_.client().bind("device", 0), 0);
    std::thread serving([this] { takeClient(); });
    EXPECT_EQ(receiver_.nextConnectStatus(), connectYes);
    isConnected_ = true;
    server_->interrupt();
    serving.join();
  }
  // Accepts clients until one is connected.
  void takeClient() {
    while (!isConnected_) {
      server_->waitForMessage();
      static_cast<void>(server_->receive());
    }
  }
  Message take() {
    Message request;
    while (!(request = server_->receive())) server_->waitForMessage();
    return request;
  }
  std::optional<MessageServer> server_{std::in_place, backplane_, "device"};
  Receiver receiver_;
  std::atomic<bool> isConnected_{false};
};

TEST_F(ClassicClientTest, GetsTheReplyWithItsNumbers) {
  connect();
  auto* request = new ::Int32Message;
  request->value = 21;
  request->setClientExtra(5);

  EXPECT_EQ(receiver_.client().send(request), 0);
  auto taken = take();
  taken.tryAs<Int32>()->value *= 2;
  static_cast<void>(server_->reply(std::move(taken)));

  const auto reply = receiver_.next();
  ASSERT_EQ(reply->getType(), messageTypeInt32);
  EXPECT_EQ(static_cast<const ::Int32Message&>(*reply).value, 42);
  EXPECT_EQ(reply->getClientExtra(), 5);
}

TEST_F(ClassicClientTest, ElementsArrive) {
  connect();
  auto* request = new ::Char8ArrayMessage;
  request->allocValue(10);
  request->setSize(4);
  std::memcpy(request->value, "*IDN", 4);
  EXPECT_EQ(receiver_.client().send(request), 0);

  const auto taken = take();

  const auto bytes = taken.valueAs<Char8Array>();
  EXPECT_EQ(std::string(bytes.begin(), bytes.end()), "*IDN");
}

TEST_F(ClassicClientTest, ARefusedRequestComesBackWithAStatus) {
  connect();
  auto* request = new ::Int32ArrayMessage;
  request->address = 6;
  request->allocValue(100);
  request->setLength(100);
  EXPECT_EQ(receiver_.client().send(request), 0);

  static_cast<void>(take());  // destroyed without a reply

  const auto answer = receiver_.next();
  const auto* old = dynamic_cast<const ::Int32ArrayMessage*>(answer.get());
  ASSERT_NE(old, nullptr);
  EXPECT_EQ(old->address, 6);
  EXPECT_EQ(old->status, fateRefused);
  EXPECT_EQ(old->getLength(), 0);
}

TEST_F(ClassicClientTest, RequestsOfAServerThatEndsComeBackBeforeTheDisconnection) {
  connect();
  EXPECT_EQ(receiver_.client().send(new ::Int32Message), 0);
  EXPECT_EQ(receiver_.client().send(new ::Float64Message), 0);
  auto taken = take();

  server_.reset();

  EXPECT_EQ(receiver_.nextStatus(), fateOutcomeUnknown);
  EXPECT_EQ(receiver_.nextStatus(), fateNeverTaken);
  EXPECT_EQ(receiver_.nextConnectStatus(), connectNo);
}

TEST_F(ClassicClientTest, AReplyWithoutAnOldFormIsAnUnknownOutcome) {
  connect();
  EXPECT_EQ(receiver_.client().send(new ::Int32Message), 0);
  auto taken = take();

  static_cast<void>(server_->reply(server_->allocReplyMessage<User>(taken, 8)));

  EXPECT_EQ(receiver_.nextStatus(), fateOutcomeUnknown);
}

TEST_F(ClassicClientTest, FurtherRepliesArrive) {
  connect();
  EXPECT_EQ(receiver_.client().send(new ::Int32Message), 0);
  const auto taken = take();
  for (const int value : {1, 2, 3}) {
    auto reply = server_->allocReplyMessage<Int32>(taken);
    reply->status = value;
    static_cast<void>(server_->reply(std::move(reply)));
  }

  for (const int value : {1, 2, 3}) EXPECT_EQ(receiver_.nextStatus(), value);
}

TEST_F(ClassicClientTest, SendFailsWithoutAConnection) {
  EXPECT_EQ(receiver_.client().send(new ::Int32Message), -1);
  EXPECT_EQ(receiver_.client().send(nullptr), -1);
  ASSERT_EQ(receiver_.client().bind("absent", 0), 0);
  EXPECT_EQ(receiver_.client().send(new ::Int32Message), -1);
}

TEST_F(ClassicClientTest, BindRefusesASecondCallAndInvalidNames) {
  testing::internal::CaptureStderr();
  EXPECT_EQ(receiver_.client().bind("", 0), -1);
  EXPECT_EQ(receiver_.client().bind("absent", 0), 0);
  EXPECT_EQ(receiver_.client().bind("absent", 0), -1);
  EXPECT_NE(testing::internal::GetCapturedStderr().find("cannot bind to server \"\""),
            std::string::npos);
}

TEST_F(ClassicClientTest, ACallbackMayDeleteItsClient) {
  // Without it, the thread of the dispatcher would remove its segments at an unknown time.
  const auto dispatcher = Dispatcher::shared(backplane_);
  struct SelfDeleting {
    static void onMessage(::Message* message, void* pvt) {
      auto& self = *static_cast<SelfDeleting*>(pvt);
      delete message;
      delete self.client;
      semGive(self.deleted);
    }
    ::MessageClient* client = new ::MessageClient(onMessage, this);
    SEM_ID deleted = semBCreate(SEM_Q_FIFO, SEM_EMPTY);
  } selfDeleting;
  EXPECT_EQ(selfDeleting.client->getClientPvt(), &selfDeleting);
  ASSERT_EQ(selfDeleting.client->bind("device", 0), 0);
  std::thread serving([this] { takeClient(); });

  EXPECT_EQ(semTake(selfDeleting.deleted, WAIT_FOREVER), OK);

  isConnected_ = true;
  server_->interrupt();
  serving.join();
  semDelete(selfDeleting.deleted);
}

}  // namespace
}  // namespace mpf::test
