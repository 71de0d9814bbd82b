// SPDX-License-Identifier: MIT
// RequestSender on a link that a Connector has opened.
#include "client/request_sender.h"

#include <gtest/gtest.h>

#include <mpf/message_server.h>

#include "tests/client/binding_parts_fixture.h"

namespace mpf::test {
namespace {

class RequestSenderTest : public BindingPartsTest {
 protected:
  void SetUp() override { connector_.setServer("dac", 0); }
  // Opens a link that the server never accepts: its messages stay in the link.
  void open() {
    const auto server = connector_.tryFindServer();
    ASSERT_TRUE(server);
    ASSERT_TRUE(connector_.tryOpenLink(server, sender_));
    connector_.askForAcceptance(sender_.channel()->link(), *owner_);
    state_ = BindingState::connected;
  }
  SendResult send(std::uint32_t id = 0) {
    Message message = Int32Message({.value = 1});
    const auto never = Deadline::never();
    const auto result = id == 0 ? sender_.send(message, never, nullptr, Retry::never)
                                : sender_.sendAs(id, message, never);
    EXPECT_EQ(static_cast<bool>(message), result != SendResult::sent);
    return result;
  }
};

TEST_F(RequestSenderTest, RefusesRequestsWithoutAConnection) {
  EXPECT_EQ(send(), SendResult::notConnected);
  EXPECT_EQ(sender_.maxMessageBytes(), 0U);
  EXPECT_EQ(reports_, 0);
}

TEST_F(RequestSenderTest, SendsOnlyInTheStateConnected) {
  const MessageServer server(backplane_, "dac");
  open();
  EXPECT_NE(sender_.maxMessageBytes(), 0U);

  EXPECT_EQ(send(), SendResult::sent);
  state_ = BindingState::ending;
  EXPECT_EQ(send(), SendResult::notConnected);

  EXPECT_EQ(sender_.requests()->outstanding(), 1U);
  connector_.closeLink(sender_);
  EXPECT_EQ(sender_.channel(), nullptr);
}

TEST_F(RequestSenderTest, ReportsASeriesOfRefusalsOnce) {
  const MessageServer server(backplane_, "dac");
  open();
  while (send() == SendResult::sent) continue;
  for (int i = 0; i < 3; ++i) EXPECT_NE(send(), SendResult::sent);

  EXPECT_EQ(reports_, 1);
  EXPECT_EQ(parts_.endpoint.control().queueFull.load(), 4U);
  connector_.closeLink(sender_);
}

TEST_F(RequestSenderTest, NudgesUntilNoReplyIsOutstanding) {
  const MessageServer server(backplane_, "dac");
  open();
  ASSERT_EQ(send(7), SendResult::sent);
  EXPECT_FALSE(sender_.tryEndNudging());

  sender_.requests()->end(*sender_.requests()->find(7));
  EXPECT_TRUE(sender_.tryEndNudging());
  timer_.reset();
  ASSERT_EQ(send(), SendResult::sent);

  EXPECT_NE(timer_.dueNs(), INT64_MAX);
  connector_.closeLink(sender_);
}

TEST_F(RequestSenderTest, AConnectorWithoutServerPublishesAPendingBindUntilItIsCancelled) {
  const auto before = backplane_.segmentNames().size();

  EXPECT_FALSE(connector_.tryFindServer());

  EXPECT_TRUE(parts_.names.isRunning());
  EXPECT_EQ(connector_.notConnectedBecause(), "server \"dac\" at location 0 is not running");
  EXPECT_EQ(backplane_.segmentNames().size(), before + 1);
  connector_.cancelPendingBind();
  EXPECT_EQ(backplane_.segmentNames().size(), before);
}

}  // namespace
}  // namespace mpf::test
