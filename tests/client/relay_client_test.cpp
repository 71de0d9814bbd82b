// SPDX-License-Identifier: MIT
// What a router needs of a client that acts on behalf of others.
#include "client/relay_client.h"

#include "tests/client/relay_fixture.h"

namespace mpf::test {
namespace {

TEST_F(RelayTest, ARequestHasTheIdThatTheCallerChose) {
  startWatched();
  bindByHand();
  ASSERT_EQ(client_.sendAs(77, Int32Message(), Deadline::never()), SendResult::sent);
  EXPECT_EQ(client_.sendAs(77, Int32Message(), Deadline::never()), SendResult::tooManyOutstanding);

  auto request = take();
  EXPECT_EQ(request.route().requestId, 77u);
  static_cast<void>(server_->reply(std::move(request)));
  EXPECT_EQ(next().route().requestId, 77u);
  EXPECT_EQ(client_.sendAs(77, Int32Message(), Deadline::never()), SendResult::sent)
      << "its place is free again";
  static_cast<void>(server_->reply(take()));
  static_cast<void>(next());
}

// While a client is paused, the reply queue of its server becomes full; after resume() no reply is
// missing.
TEST_F(RelayTest, APausedClientLeavesRepliesInTheQueue) {
  auto& server = startWatched();
  bindByHand();
  ASSERT_EQ(client_.send(Int32Message()), SendResult::sent);
  auto request = take();
  client_.pause();

  int sent = 0;
  for (;; ++sent) {
    auto extra = server.allocReplyMessage<Int32>(request);
    extra->value = sent;
    if (server.reply(std::move(extra)) != ReplyResult::sent) break;
  }
  for (int looks = 0; looks < 10; ++looks) dispatcher_.runOnce(Deadline::after(1ms));
  EXPECT_THAT(messages_, testing::IsEmpty());

  client_.resume();
  for (int got = 0; got < sent; ++got) EXPECT_EQ(next().tryAs<Int32>()->value, got);
}

}  // namespace
}  // namespace mpf::test
