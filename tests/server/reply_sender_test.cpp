// SPDX-License-Identifier: MIT
// ReplySender: first and further replies, refusals that leave the message unchanged, and fates.
#include "server/reply_sender.h"

#include <gtest/gtest.h>

#include "tests/base/child_process.h"
#include "tests/server/server_parts_fixture.h"

namespace mpf::test {
namespace {

class ReplySenderTest : public ServerPartsTest {
 protected:
  static Int32Message replyTo(const Route& route) {
    Int32Message reply({.value = 7});
    reply.setClientType(5);
    reply.setRoute(route);
    return reply;
  }
  // Whether the client's next message is this fate of the request.
  static bool takesFate(Link& link, std::uint32_t requestId, Fate fate) {
    if (!link.incoming().hasMessage()) return false;
    const auto envelope = link.incoming().begin();
    RequestFate body{};
    link.incoming().copyBody(std::as_writable_bytes(std::span(&body, 1)));
    link.incoming().end();
    return envelope.type == static_cast<std::uint16_t>(MessageType::requestFate) &&
           envelope.requestId == requestId && body.requestId == requestId && body.fate == fate;
  }

  Link& link_ = createLink();
  Connection& connection_ = accept(link_);
};

TEST_F(ReplySenderTest, TheFirstReplyEndsTheRequest) {
  const auto route = noteRequest(connection_, 3);
  auto first = replyTo(route);
  auto further = replyTo(route);

  EXPECT_EQ(replies_.send(first), ReplyResult::sent);
  EXPECT_FALSE(first);
  EXPECT_FALSE(connection_.isUnanswered(3));
  EXPECT_EQ(replies_.send(further), ReplyResult::sent);

  const auto received = take(link_);
  EXPECT_EQ(received.requestId, 3u);
  EXPECT_EQ(received.clientType, 5);
  EXPECT_EQ(received.flags, layout::kSlotFirstReply);
  EXPECT_EQ(take(link_).flags, 0u);
  EXPECT_EQ(valueOf(control().sent), 2u);
}

// A subscription is kept, and its client has used all ids since.
TEST_F(ReplySenderTest, AFurtherReplyDoesNotEndAnotherRequestWithTheSameId) {
  const auto subscription = noteRequest(connection_, 3);
  auto first = replyTo(subscription);
  ASSERT_EQ(replies_.send(first), ReplyResult::sent);
  ASSERT_EQ(take(link_).flags, layout::kSlotFirstReply);
  noteRequest(connection_, 0xFFFFFFFF);
  const auto request = noteRequest(connection_, 3);

  auto further = replyTo(subscription);
  EXPECT_EQ(replies_.send(further), ReplyResult::sent);
  EXPECT_EQ(take(link_).flags, 0u);
  replies_.refuseAbandoned(subscription);
  EXPECT_FALSE(link_.incoming().hasMessage());

  auto reply = replyTo(request);
  EXPECT_EQ(replies_.send(reply), ReplyResult::sent);
  EXPECT_EQ(take(link_).flags, layout::kSlotFirstReply);
}

TEST_F(ReplySenderTest, CountsItsRepliesWhateverTheClientWrites) {
  auto reply = replyTo(noteRequest(connection_, 3));
  link_.control().serverSent.store(1000, std::memory_order_relaxed);

  EXPECT_EQ(replies_.send(reply), ReplyResult::sent);

  EXPECT_EQ(valueOf(control().sent), 1u);
  EXPECT_EQ(valueOf(link_.control().serverSent), 1u);
}

TEST_F(ReplySenderTest, AReplyToAClientThatHasDisconnectedIsDropped) {
  auto reply = replyTo(noteRequest(connection_, 3));
  connections_.close(connection_);

  EXPECT_EQ(replies_.send(reply), ReplyResult::clientGone);

  EXPECT_FALSE(reply);
  EXPECT_FALSE(link_.incoming().hasMessage());
}

TEST_F(ReplySenderTest, AMessageWithoutARouteIsNoReplyAndIsDropped) {
  Int32Message message;

  EXPECT_EQ(replies_.send(message), ReplyResult::clientGone);

  EXPECT_FALSE(message);
}

TEST_F(ReplySenderTest, AReplyInTheChildOfAForkIsDropped) {
  auto reply = replyTo(noteRequest(connection_, 3));

  const auto status = endOf([&] {
    EXPECT_EQ(replies_.send(reply), ReplyResult::clientGone);
    EXPECT_FALSE(reply);
    return HasFailure() ? 1 : 0;
  });

  EXPECT_EQ(status, 0);
  EXPECT_FALSE(link_.incoming().hasMessage());
}

TEST_F(ReplySenderTest, AReplyAboveTheLimitStaysWithItsOwner) {
  const auto route = noteRequest(connection_, 3);
  auto reply = Char8ArrayMessage::allocValue((1 << 20) + 1);  // Offer::maxMessageBytes
  reply.setRoute(route);

  EXPECT_EQ(replies_.send(reply), ReplyResult::tooLarge);

  EXPECT_TRUE(reply);
  EXPECT_EQ(reply.route().requestId, 3u);
  EXPECT_TRUE(connection_.isUnanswered(3));
  EXPECT_EQ(valueOf(control().replyQueueFull), 1u);
}

TEST_F(ReplySenderTest, AFullQueueRefusesFurtherRepliesButNotTheFirst) {
  const auto route = noteRequest(connection_, 3);
  const auto unowned = connection_.routeOf(4, nullptr);
  auto result = ReplyResult::sent;
  while (result == ReplyResult::sent) {
    auto further = replyTo(unowned);
    result = replies_.send(further);
  }
  auto first = replyTo(route);

  EXPECT_EQ(result, ReplyResult::queueFull);
  EXPECT_EQ(replies_.send(first), ReplyResult::sent);
}

TEST_F(ReplySenderTest, TheTimeOfSendingIsThatOfTheAttemptThatSucceeds) {
  ReplySender stamping{counts_, true};
  auto further = replyTo(connection_.routeOf(4, nullptr));
  while (replies_.send(further) == ReplyResult::sent) further = replyTo(further.route());

  EXPECT_EQ(stamping.send(further), ReplyResult::queueFull);
  EXPECT_EQ(further.getTimeStampNs(), 0);
  while (link_.incoming().hasMessage()) static_cast<void>(take(link_));
  link_.incoming().onEmpty();

  ASSERT_EQ(stamping.send(further), ReplyResult::sent);
  EXPECT_NE(take(link_).timeNs, 0);
}

TEST_F(ReplySenderTest, AnAbandonedRequestIsRefusedOnce) {
  const auto route = noteRequest(connection_, 3);

  replies_.refuseAbandoned(route);
  replies_.refuseAbandoned(route);

  EXPECT_TRUE(takesFate(link_, 3, Fate::refused));
  EXPECT_FALSE(link_.incoming().hasMessage());
  EXPECT_EQ(valueOf(control().refused), 1u);
}

TEST_F(ReplySenderTest, AFateEndsTheRequest) {
  noteRequest(connection_, 3);

  replies_.sendFate(connection_, {.requestId = 3}, Fate::expired);

  EXPECT_TRUE(takesFate(link_, 3, Fate::expired));
  EXPECT_FALSE(connection_.isUnanswered(3));
}

TEST_F(ReplySenderTest, ALargeBodyIsInThePoolWhileTheClientIsConnected) {
  const auto route = noteRequest(connection_, 3);
  const auto release = [](BodyBytes body) { body.lender->takeBack(body.data, body.capacity); };

  const auto shared = ReplySender::allocate(route, 10'000);
  EXPECT_EQ(shared.lender, connection_.channel.get());
  release(shared);
  connections_.close(connection_);
  const auto heap = ReplySender::allocate(route, 10'000);

  EXPECT_NE(heap.lender, shared.lender);
  release(heap);
}

}  // namespace
}  // namespace mpf::test
