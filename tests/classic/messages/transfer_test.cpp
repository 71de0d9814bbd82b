// SPDX-License-Identifier: MIT
#include "classic/messages/transfer.h"

#include <algorithm>
#include <gtest/gtest.h>
#include <memory>

#include "schema/text.h"
#include "tests/support/every_message.h"

namespace mpf::test {
namespace {

using classic::Transfer;

TEST(Transfer, EachFieldAndElementSurvivesBothWays) {
  for (auto& message : everyMessage()) {
    const auto type = message.getType();
    if (type == MessageType::requestFate || type == MessageType::user) continue;
    if (auto* connect = message.tryAs<Connect>()) connect->incarnation = 0;  // a new field
    message.setClientType(7);
    message.setClientExtra(8);
    const auto before = print(message);

    const auto old = Transfer::receive(std::move(message));

    ASSERT_NE(old, nullptr) << before;
    EXPECT_EQ(old->getClientType(), 7);
    EXPECT_EQ(print(Transfer::send(*old)), before);
  }
}

TEST(Transfer, MessagesWithoutAnOldFormAreLeftAlone) {
  Message fate = RequestFateMessage({.requestId = 4});

  EXPECT_EQ(Transfer::receive(std::move(fate)), nullptr);
  EXPECT_TRUE(fate);  // NOLINT(bugprone-use-after-move): unchanged
}

TEST(Transfer, AReplyHasTheNumbersAndTheRouteOfItsRequest) {
  Message message = Float64Message({.value = 1});
  message.setClientExtra(8);
  message.setRoute({.link = 3, .requestId = 5});
  auto request = Transfer::receive(std::move(message));

  const auto reply = Transfer::makeReply(*request, messageTypeInt32Array);
  request.reset();  // as old servers do
  const auto sent = Transfer::send(*reply);

  EXPECT_EQ(sent.getType(), MessageType::int32Array);
  EXPECT_EQ(sent.getClientExtra(), 8);
  EXPECT_EQ(sent.route().requestId, 5U);
}

struct CountingKeeper final : RouteKeeper {
  void abandoned(const Route&) noexcept override { ++refused; }
  int refused = 0;
};

TEST(Transfer, ARequestIsRefusedWhenItAndItsRepliesAreDeleted) {
  CountingKeeper keeper;
  Message message = Int32Message();
  message.setRoute({.link = 3, .requestId = 5, .keeper = &keeper});
  auto request = Transfer::receive(std::move(message));
  auto reply = Transfer::makeReply(*request, messageTypeInt32);

  request.reset();
  EXPECT_EQ(keeper.refused, 0);
  reply.reset();
  EXPECT_EQ(keeper.refused, 1);
}

TEST(Transfer, ARequestWithoutAReplyIsItsOwnAnswer) {
  auto request = std::make_unique<::Int32Message>();
  request->address = 6;

  const auto answer = Transfer::withFate(std::move(request), Fate::neverTaken);

  const auto* old = dynamic_cast<::Int32Message*>(answer.get());
  ASSERT_NE(old, nullptr);
  EXPECT_EQ(old->address, 6);
  EXPECT_EQ(old->status, fateNeverTaken);
}

TEST(Transfer, ASerialConfigWithoutAReplyIsAnInt32WithAStatus) {
  auto request = std::make_unique<::SerialConfigMessage>();
  request->setClientExtra(9);

  const auto answer = Transfer::withFate(std::move(request), Fate::refused);

  ASSERT_EQ(answer->getType(), messageTypeInt32);
  EXPECT_EQ(answer->getClientExtra(), 9);
  EXPECT_EQ(static_cast<const ::Int32Message&>(*answer).status, fateRefused);
}

}  // namespace
}  // namespace mpf::test
