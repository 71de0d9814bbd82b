// SPDX-License-Identifier: MIT
// mrr: the lines of the manual, "Diagnostic Aids".
#include <regex>

#include "tests/tools/report/report_fixture.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::MatchesRegex;

TEST_F(ReportTest, MrrPrintsTheLinesOfTheManual) {
  openServer("Int32");
  connect();
  MessageClient second(*dispatcher_, [](const Message&) {});
  second.bind("Int32", 0);
  while (!second.isConnected()) {
    server_->handleOne();
    dispatcher_->runOnce(Deadline::after(100us));
  }
  ASSERT_EQ(send(), SendResult::sent);
  const auto us = "tools_test\\[" + std::to_string(::getpid()) + "\\]";

  const auto ended = run({"mrr", "--interval", "100ms"});

  EXPECT_EQ(ended.status, 0);
  // Joins a line of more than 80 columns, which a long pid may cause.
  const auto whole = std::regex_replace(ended.out, std::regex("\n     "), " ");
  EXPECT_THAT(
      linesOf(whole),
      ElementsAre(
          "backplane " + backplane_.name(), "clientRouterList",
          MatchesRegex(" 1 " + us +
                       " stateConnected queueSize 100 inQueue 1 sendQueueFull 0 unanswered 1"),
          "   Server Int32 has 2 clients. bindState connected", "   sendPerSec 0 receivePerSec 0",
          "serverRouterList",
          MatchesRegex(
              " 1 Int32\\[[0-9]+\\] stalled queueSize 100 inQueue 1 replyQueueFull 0 clients 2"),
          "   sendPerSec 0 receivePerSec 0"));
}

}  // namespace
}  // namespace mpf::test
