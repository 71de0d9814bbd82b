// SPDX-License-Identifier: MIT
// mpf top on a pseudo-terminal.
#include <mpf/message_client.h>

#include "tests/support/terminal.h"
#include "tests/tools/report/router_rows.h"
#include "tests/tools/tools_fixture.h"

namespace mpf::test {
namespace {

class TopTest : public ToolsTest {
 protected:
  std::unique_ptr<Terminal> top(std::vector<std::string> more = {}, int rows = 24,
                                int columns = 80) const {
    std::vector<std::string> command{MPF_TEST_TOOL,     "top",        "--backplane",
                                     backplane_.name(), "--interval", "0.1"};
    command.insert(command.end(), more.begin(), more.end());
    return std::make_unique<Terminal>(std::move(command), rows, columns);
  }
};

TEST_F(TopTest, ShowsServersAndTheirClientsAndALinkOfOne) {
  const EchoThread alpha(backplane_, "alpha");
  const EchoThread beta(backplane_, "beta");
  SyncClient client(backplane_, "beta");
  ASSERT_TRUE(client.connectWait(60s));
  const auto top = this->top();

  ASSERT_TRUE(top->waitFor("alpha")) << top->screen();
  EXPECT_THAT(top->row(0), testing::HasSubstr("2 servers, 1 client, 1 link, "));
  top->type("j\r");
  ASSERT_TRUE(top->waitFor("CLIENT*")) << top->screen();
  top->type("\r");
  ASSERT_TRUE(top->waitFor("shared memory")) << top->screen();
  EXPECT_THAT(top->screen(), testing::HasSubstr("beta, alive"));
  top->type("\033");
  ASSERT_TRUE(top->waitFor("CLIENT*")) << top->screen();
  top->type("\t");
  ASSERT_TRUE(top->waitFor("REPLY99")) << top->screen();

  top->type("q");

  EXPECT_EQ(top->wait(), 0);
  EXPECT_TRUE(top->isRestored());
}

TEST_F(TopTest, FiltersWhileTheUserTypes) {
  const EchoThread alpha(backplane_, "alpha");
  const EchoThread beta(backplane_, "beta[jk]");
  const auto top = this->top();
  ASSERT_TRUE(top->waitFor("alpha"));

  top->type("/a[jk]\r");

  ASSERT_TRUE(top->waitFor("filter: a[jk]  q quit")) << top->screen();
  EXPECT_THAT(top->screen(), testing::HasSubstr("beta[jk]"));
  EXPECT_THAT(top->screen(), testing::Not(testing::HasSubstr("alpha")));
}

TEST_F(TopTest, ShowsAServerThatHasStalled) {
  MessageServer stuck(backplane_, "stuck");
  std::jthread accepting([&](const std::stop_token& stop) {
    while (!stop.stop_requested())
      static_cast<void>(stuck.waitForMessage(Deadline::after(1ms)) && stuck.receive());
  });
  MessageClient client(backplane_, [](const Message&) {});
  client.bind("stuck");
  ASSERT_TRUE(client.connectWait(60s));
  accepting.request_stop();
  accepting.join();
  ASSERT_EQ(client.send(Int32Message({.value = 1})), SendResult::sent);

  const auto top = this->top();

  EXPECT_TRUE(top->waitFor("stalled")) << top->screen();
  EXPECT_TRUE(top->look(2).isRed && top->look(2).isReversed) << "selected, and an alarm";
}

TEST_F(TopTest, ShowsConnectionsToOtherHosts) {
  router::Statistics statistics(backplane_, "lab1");
  const auto remote = connectedRemote(statistics, {1});
  const auto lost = lostRemote(statistics);
  const auto top = this->top({"--routers"});

  ASSERT_TRUE(top->waitFor("→ 10.0.0.8:9900")) << top->screen();
  EXPECT_THAT(top->row(0), testing::HasSubstr("1 of 2 connections cut"));
  EXPECT_TRUE(top->look(2).isRed);
  EXPECT_FALSE(top->look(3).isRed);
  top->type("j\r");
  ASSERT_TRUE(top->waitFor("mpf-router 0.1.0")) << top->screen();
  EXPECT_THAT(top->row(0), testing::HasSubstr("router → ioc1, connected"));
  top->type("?");
  ASSERT_TRUE(top->waitFor("not connected")) << top->screen();
  top->type("q");

  EXPECT_EQ(top->wait(), 0);
}

TEST_F(TopTest, FitsTheSizeOfTheTerminal) {
  const EchoThread server(backplane_, "echo");
  const auto top = this->top({}, 10, 40);
  ASSERT_TRUE(top->waitFor("q quit"));
  EXPECT_THAT(top->row(9), testing::HasSubstr("q quit"));

  top->resize(30, 100);

  ASSERT_TRUE(top->waitFor("/ filter")) << top->screen();
  EXPECT_THAT(top->row(29), testing::HasSubstr("q quit"));
}

TEST_F(TopTest, RestoresTheTerminalOnASignal) {
  for (const int number : {SIGTERM, SIGINT}) {
    const auto top = this->top();
    ASSERT_TRUE(top->waitFor("0 servers"));
    EXPECT_FALSE(top->isRestored());

    top->signal(number);

    EXPECT_EQ(top->wait(), 0);
    EXPECT_TRUE(top->isRestored());
  }
}

TEST_F(TopTest, FailsWithoutATerminal) {
  const auto ended = run({"top"});

  EXPECT_EQ(ended.status, 1);
  EXPECT_THAT(ended.err, testing::HasSubstr("--batch"));
  EXPECT_THAT(ended.out, testing::IsEmpty());
}

TEST_F(TopTest, PrintsABatch) {
  const EchoThread alpha(backplane_, "alpha");
  const EchoThread beta(backplane_, "beta");

  const auto ended =
      run({"top", "--batch", "2", "--interval", "0.01", "--filter", "beta", "--sort", "REQ/s"});

  EXPECT_EQ(ended.status, 0) << ended.err;
  EXPECT_THAT(ended.out, testing::HasSubstr("REQ/s*"));
  const auto first = ended.out.find("\nbeta ");
  ASSERT_NE(first, std::string::npos) << ended.out;
  EXPECT_NE(ended.out.find("\nbeta ", first + 1), std::string::npos);
  EXPECT_THAT(ended.out, testing::Not(testing::HasSubstr("\nalpha ")));
  EXPECT_EQ(run({"top", "--batch", "1", "--interval", "0.01", "--sort", "COLOUR"}).status, 2);
}

TEST_F(TopTest, ShowsAThousandLinks) {
  constexpr std::size_t kLinks = 1000;
  const EchoThread server(backplane_, "busy", {.queueSize = 1});
  std::vector<std::unique_ptr<MessageClient>> clients;
  for (std::size_t i = 0; i < kLinks; ++i) {
    clients.push_back(std::make_unique<MessageClient>(backplane_, [](const Message&) {}));
    clients.back()->bind("busy");
  }
  for (const auto& client : clients) ASSERT_TRUE(client->connectWait(60s));
  const auto top = this->top();

  ASSERT_TRUE(top->waitFor("1000 links")) << top->screen();
  top->type("\r");
  ASSERT_TRUE(top->waitFor("CLIENT*")) << top->screen();
  top->type("s");
  ASSERT_TRUE(top->waitFor("STATE*")) << top->screen();
  top->type("q");

  EXPECT_EQ(top->wait(), 0);
}

// If the terminal broke a line of mrr, the rest of it would have no indent.
TEST_F(TopTest, ReportsUseTheWidthOfTheTerminal) {
  const std::string name(40, 'x');
  const EchoThread echo(backplane_, name);
  const std::vector<std::string> mrr{MPF_TEST_TOOL,     "mrr",        "--backplane",
                                     backplane_.name(), "--interval", "1"};
  Terminal narrow(mrr, 24, 60);
  Terminal wide(mrr, 24, 200);

  EXPECT_EQ(narrow.wait(), 0);
  EXPECT_EQ(wide.wait(), 0);

  const auto lines = linesOf(narrow.screen());
  const auto last = std::ranges::find_if(
      lines, [](const std::string& line) { return line.find("clients 0") != std::string::npos; });
  ASSERT_NE(last, lines.end()) << narrow.screen();
  EXPECT_THAT(*last, testing::StartsWith("     "));
  EXPECT_THAT(wide.screen(),
              testing::HasSubstr(" queueSize 100 inQueue 0 replyQueueFull 0 clients 0"));
  EXPECT_THAT(wide.screen(), testing::HasSubstr(" 1 " + name + "["));
}

}  // namespace
}  // namespace mpf::test
