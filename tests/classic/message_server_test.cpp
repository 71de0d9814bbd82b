// SPDX-License-Identifier: MIT
// Servers of the original API with clients of the new one.
#include <mpf/message_server.h>

#include <mpf/sync_client.h>

#include "tests/classic/classic_fixture.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

class ClassicServerTest : public ClassicTest {
 protected:
  Answer call(Message&& message) {
    SyncClient client(backplane_, "device");
    return client.call(std::move(message), 600s);
  }
};

TEST_F(ClassicServerTest, RepliesWithTheRequest) {
  const ClassicServer server("device", 1, [](::MessageServer& self, ::Message* request) {
    auto* message = static_cast<::Int32Message*>(request);
    message->value *= 2;
    EXPECT_EQ(self.reply(message), 0);
  });

  const auto reply = call(Int32Message({.address = 3, .value = 21})).as<Int32>();

  ASSERT_TRUE(reply);
  EXPECT_EQ((*reply)->value, 42);
  EXPECT_EQ((*reply)->address, 3);
}

TEST_F(ClassicServerTest, RepliesWithAnotherTypeAfterTheRequestWasDeleted) {
  const ClassicServer server("device", 1, [](::MessageServer& self, ::Message* request) {
    auto* reply = static_cast<::Float64ArrayMessage*>(
        self.allocReplyMessage(request, messageTypeFloat64Array));
    reply->allocValue(1000);
    reply->setLength(1000);
    reply->value[999] = 0.5;
    delete request;
    EXPECT_EQ(self.reply(reply), 0);
  });

  const auto reply = call(Int32Message()).as<Float64Array>();

  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->getLength(), 1000U);
  EXPECT_EQ(reply->value()[999], 0.5);
}

TEST_F(ClassicServerTest, ADeletedRequestIsRefused) {
  const ClassicServer server("device", 1,
                             [](::MessageServer&, ::Message* request) { delete request; });

  EXPECT_EQ(call(Int32Message()).fate(), Fate::refused);
}

TEST_F(ClassicServerTest, ARequestWhoseReplyIsDeletedIsRefused) {
  const ClassicServer server("device", 1, [](::MessageServer& self, ::Message* request) {
    const auto* reply = self.allocReplyMessage(request, messageTypeInt32);
    delete request;
    delete reply;
  });

  EXPECT_EQ(call(Int32Message()).fate(), Fate::refused);
}

TEST_F(ClassicServerTest, ARequestOfANewTypeIsRefusedAndTheNextIsServed) {
  const ClassicServer server("device", 1, [](::MessageServer& self, ::Message* request) {
    EXPECT_EQ(self.reply(request), 0);
  });
  EXPECT_EQ(call(UserMessage::allocValue(8)).fate(), Fate::refused);

  EXPECT_TRUE(call(Int32Message()));
}

TEST_F(ClassicServerTest, AKeptRequestHasAnyNumberOfReplies) {
  const ClassicServer server("device", 1, [](::MessageServer& self, ::Message* request) {
    for (const int value : {1, 2, 3}) {
      auto* reply = static_cast<::Int32Message*>(self.allocReplyMessage(request, messageTypeInt32));
      reply->value = value;
      EXPECT_EQ(self.reply(reply), 0);
    }
    delete request;
  });
  SyncClient client(backplane_, "device");

  EXPECT_EQ((*client.call(Int32Message(), 600s).as<Int32>())->value, 1);
  EXPECT_EQ(client.receive(600s).tryAs<Int32>()->value, 2);
  EXPECT_EQ(client.receive(600s).tryAs<Int32>()->value, 3);
}

TEST_F(ClassicServerTest, AReplyToAClientThatIsGoneFails) {
  ::MessageServer server("device", 20);
  EXPECT_EQ(server.reply(nullptr), -1);
  EXPECT_EQ(server.reply(new ::Int32Message), -1);
}

TEST_F(ClassicServerTest, AllocReplyMessageRefusesUnknownTypes) {
  ::MessageServer server("device");
  ::Int32Message message;
  EXPECT_EQ(server.allocReplyMessage(&message, static_cast<messageType>(99)), nullptr);
  EXPECT_STREQ(server.getName(), "device");
}

TEST_F(ClassicServerTest, SizesOfQueuesAreLimited) {
  ::MessageServer server("device", 1'000'000);
  server.setQueueSize(0);
  testing::internal::CaptureStdout();
  server.report();
  EXPECT_NE(testing::internal::GetCapturedStdout().find("queueSize 1\n"), std::string::npos);
}

TEST_F(ClassicServerTest, AServerWhoseNameIsInUseStartsWhenTheNameIsFree) {
  std::optional<MessageServer> other(std::in_place, backplane_, "device");
  testing::internal::CaptureStderr();
  const ClassicServer server("device", 1, [](::MessageServer& self, ::Message* request) {
    EXPECT_EQ(self.reply(request), 0);
  });
  EXPECT_NE(testing::internal::GetCapturedStderr().find("\"device\": not served yet"),
            std::string::npos);

  other.reset();

  EXPECT_TRUE(call(Int32Message()));
}

}  // namespace
}  // namespace mpf::test
