// SPDX-License-Identifier: MIT
// Proxy: credit for replies, and replies for which their client has no room.
#include "router/outgoing/proxy.h"

#include "tests/router/router_parts_fixture.h"
#include "tests/router/server_items.h"
#include "tests/support/caller.h"
#include "tests/support/no_descriptors.h"

namespace mpf::test {
namespace {

using router::Proxy;
using router::RemoteConnection;
using testing::HasSubstr;
using testing::StartsWith;

class ProxyTest : public RouterPartsTest {
 protected:
  ~ProxyTest() noexcept override = default;

  static constexpr std::uint32_t kWindowBytes = 1 << 20;

  void SetUp() override {
    context_.config.limits.windowBytes = kWindowBytes;
    onPlain_ = [this](router::PlainItem& item) { proxy_->reply(item); };
    onPlainItems_ = [this](const router::PlainItems& items) {
      ++together_;
      proxy_->reply(items);
    };
    startGreeted(greeting([](auto greeting) { greeting.setMaxClients(1); }));
    connection_.emplace(*line_, record_, context_.log, "far:9900", [] {});
    proxy_.emplace(context_, *connection_, router::ServerName{1, "echo"},
                   Proxy::Offer{.binding = 1,
                                .incarnation = kIncarnation,
                                .queueSize = 4,
                                .maxMessageBytes = kWindowBytes});
    onItem_ = [this](wire::Item::Reader item) {
      if (item.isReply()) proxy_->reply(item.getReply().getClient(), item.getReply());
    };
    caller_.emplace(dispatcher_);
    runClientUntil([this] { return caller_->isConnected(); });
    EXPECT_THAT(nextItem(), StartsWith("(open = (client = 1, binding = 1"));
  }
  void TearDown() override {
    caller_.reset();
    proxy_.reset();
    connection_.reset();
    RouterPartsTest::TearDown();
  }
  std::uint32_t sendRequest() {
    const auto id = caller_->send(Int32Message());
    EXPECT_THAT(nextItem(), StartsWith("(request = (client = 1, "));
    return id;
  }
  void runClientUntil(const std::function<bool()>& isDone) {
    runUntil([&] {
      dispatcher_.runPending();
      return isDone();
    });
  }

  Dispatcher dispatcher_{backplane_, {}};
  std::optional<RemoteConnection> connection_;
  std::optional<Proxy> proxy_;
  std::optional<Caller> caller_;
  int together_ = 0;  // times that replies came together
};

TEST_F(ProxyTest, AReplyThatUsesUpTheWindowGivesItAllBack) {
  const auto id = sendRequest();

  send(frameOf(
      {replyOf(1, id, [](auto message) { message.initUser().initValue(kWindowBytes - 64); })}));

  EXPECT_THAT(nextItem(), HasSubstr("(credit = (client = 1, bytes = 1048576))"));
}

TEST_F(ProxyTest, ClientsThatThePeerDoesNotAcceptAreClients) {
  Proxy other(context_, *connection_, {1, "other"}, {.binding = 2, .queueSize = 4});
  EXPECT_FALSE(other.hasClients());
  const Caller caller(dispatcher_, "other");  // the peer accepts one client, which is caller_

  runClientUntil([&] { return caller.isConnected(); });

  EXPECT_TRUE(other.hasClients());
}

TEST_F(ProxyTest, AShortageOfDescriptorsIsLogged) {
  const Caller another(dispatcher_);
  dispatcher_.runPending();  // asks to be accepted
  {
    const NoDescriptors none;
    runUntil([this] { return logged_.find("cannot accept another client") != std::string::npos; });
  }

  EXPECT_THAT(logged_, HasSubstr("\"echo\" cannot accept another client: "));
  EXPECT_THAT(logged_, HasSubstr("ulimit -n"));
}

TEST_F(ProxyTest, RequestsThatWaitTogetherAreAnsweredTogether) {
  constexpr std::int32_t kRequests = 4;
  std::vector<std::uint32_t> ids;
  for (std::int32_t i = 0; i < kRequests; ++i) {
    Int32Message message({.value = i});
    message.setClientType(i + 100);
    ids.push_back(caller_->send(std::move(message)));
  }
  std::vector<Fill> replies;
  for (std::int32_t i = 0; i < kRequests; ++i) {
    const auto id = ids[static_cast<std::size_t>(i)];
    EXPECT_THAT(nextItem(),
                AllOf(StartsWith("(request = (client = 1, requestId = " + std::to_string(id)),
                      HasSubstr("clientType = " + std::to_string(i + 100))));
    replies.push_back(test::reply(1, id, true, i));
  }

  send(frameOf(replies));
  runClientUntil([this] { return caller_->messages.size() == kRequests; });

  for (std::int32_t i = 0; i < kRequests; ++i) EXPECT_EQ(caller_->take().tryAs<Int32>()->value, i);
  EXPECT_EQ(together_, 1);
}

TEST_F(ProxyTest, RequestsOfARefusedClientThatWaitTogetherAreRefused) {
  constexpr std::size_t kRequests = 3;
  proxy_->refuse(1, "it is full");
  for (std::size_t count = 0; count < kRequests; ++count) caller_->send(Int32Message());

  runClientUntil([this] { return caller_->messages.size() == kRequests; });

  for (std::size_t count = 0; count < kRequests; ++count)
    EXPECT_EQ(fateOf(caller_->take()), Fate::refused);
  send(frameOf({ping(1)}));
  EXPECT_THAT(nextItem(), StartsWith("(pong")) << "the peer has received none of them";
}

TEST_F(ProxyTest, ASecondFirstReplyEndsTheLine) {
  const auto first = sendRequest();
  const auto second = sendRequest();
  send(frameOf({test::reply(1, second, true, 2)}));

  send(frameOf({test::reply(1, first, true, 1), test::reply(1, second, true, 3)}));

  EXPECT_THAT(farewell(), HasSubstr("a first reply to request " + std::to_string(second)));
  runClientUntil([this] { return caller_->messages.size() == 2; });
  EXPECT_EQ(caller_->take().tryAs<Int32>()->value, 2);
  EXPECT_EQ(caller_->take().tryAs<Int32>()->value, 1);
}

TEST_F(ProxyTest, RepliesThatComeTogetherMayNotExceedTheWindow) {
  const auto id = sendRequest();
  send(frameOf({replyOf(1, id, [](auto message) { message.initInt32(); })}));
  std::vector<Fill> replies;
  for (std::uint32_t count = 0; count <= kWindowBytes / 64; ++count)
    replies.push_back(test::reply(1, id, false));

  send(frameOf(replies));

  EXPECT_THAT(farewell(), HasSubstr("beyond its window of 1048576 bytes"));
}

TEST_F(ProxyTest, RequestsThatWaitTogetherAreRefusedIfThePeerAcceptsNoMoreClients) {
  Caller second(dispatcher_);
  runClientUntil([&] { return second.isConnected(); });
  for (int count = 0; count < 2; ++count) second.send(Int32Message());

  runClientUntil([&] { return second.messages.size() == 2; });

  for (int count = 0; count < 2; ++count) EXPECT_EQ(fateOf(second.take()), Fate::refused);
}

// Far more replies than the client has room for, before it receives the first one.
TEST_F(ProxyTest, RepliesAreHeldInOrderUntilTheClientHasRoom) {
  constexpr std::int32_t kReplies = 200;
  const auto id = sendRequest();
  std::vector<Fill> replies;
  for (std::int32_t i = 0; i < kReplies; ++i) replies.push_back(test::reply(1, id, i == 0, i));
  const auto last = replies.end() - 3;

  send(frameOf({replies.begin(), last}));
  dispatcher_.runPending();  // now there is room
  send(frameOf({last, replies.end()}));
  runClientUntil([this] { return caller_->messages.size() == kReplies; });

  for (std::int32_t i = 0; i < kReplies; ++i) {
    const auto reply = caller_->take();
    ASSERT_NE(reply.tryAs<Int32>(), nullptr);
    ASSERT_EQ(reply.tryAs<Int32>()->value, i);
  }
}

// Also the numbers of replies that are held.
TEST_F(ProxyTest, TheClientIsToldHowManyMessagesItMissed) {
  constexpr std::uint32_t kReplies = 200;
  const auto id = sendRequest();
  std::vector<Fill> replies;
  for (std::uint32_t i = 0; i < kReplies; ++i) {
    replies.push_back([=](wire::Item::Builder item) {
      test::reply(1, id, i == 0, static_cast<std::int32_t>(i))(item);
      item.getReply().setMissed(i % 8 == 1 ? 7u : 0u);
    });
  }

  send(frameOf(replies));
  runClientUntil([this] { return caller_->messages.size() == kReplies; });

  for (std::uint32_t i = 0; i < kReplies; ++i) {
    const auto reply = caller_->take();
    ASSERT_NE(reply.tryAs<Int32>(), nullptr);
    ASSERT_EQ(reply.tryAs<Int32>()->value, static_cast<std::int32_t>(i));
    ASSERT_EQ(reply.getMissed(), i % 8 == 1 ? 7u : 0u);
  }
}

}  // namespace
}  // namespace mpf::test
