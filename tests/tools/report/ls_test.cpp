// SPDX-License-Identifier: MIT
// ls: servers and clients in every state.
#include <sys/wait.h>

#include "tests/support/victim.h"
#include "tests/tools/report/report_fixture.h"

namespace mpf::test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::MatchesRegex;
using testing::SizeIs;

TEST_F(ReportTest, ListsServersAndClients) {
  openServer("dac/1");
  connect();
  const auto pid = std::to_string(::getpid());

  const auto ended = run({"ls"});

  EXPECT_EQ(ended.status, 0);
  EXPECT_THAT(ended.err, IsEmpty());
  EXPECT_THAT(
      linesOf(ended.out),
      ElementsAre("backplane " + backplane_.name(),
                  MatchesRegex("  SERVER +STATE +PID +PROGRAM +CONN +QUEUED +TAKEN +AGE"),
                  MatchesRegex("  dac/1 +alive +" + pid + " +tools_test +1 +0 +0 +[0-9.]+ [mun]?s"),
                  MatchesRegex("  CLIENT +STATE +PID +UNANSWERED +AGE +SERVERS"),
                  MatchesRegex("  tools_test +alive +" + pid + " +0 +[0-9.]+ [mun]?s +dac/1")));
}

TEST_F(ReportTest, JsonHasTheSameContent) {
  openServer("dac/1", 7);
  connect();
  ASSERT_EQ(send(), SendResult::sent);
  ASSERT_EQ(send(), SendResult::sent);
  handle(1);

  const auto all = ls();

  EXPECT_EQ(all.at("backplane"), backplane_.name());
  EXPECT_THAT(all.at("problems"), SizeIs(0));
  EXPECT_THAT(all.at("waiting"), SizeIs(0));
  ASSERT_THAT(all.at("servers"), SizeIs(1));
  const auto& server = all.at("servers").at(0);
  EXPECT_EQ(server.at("name"), "dac/1");
  EXPECT_EQ(server.at("pid"), ::getpid());
  EXPECT_EQ(server.at("program"), "tools_test");
  EXPECT_EQ(server.at("location"), 0);
  EXPECT_EQ(server.at("queue_size"), 7);
  EXPECT_EQ(server.at("received"), 1);
  EXPECT_EQ(server.at("replies"), 1);
  ASSERT_THAT(server.at("links"), SizeIs(1));
  EXPECT_EQ(server.at("links").at(0).at("peer_pid"), ::getpid());
  ASSERT_THAT(all.at("clients"), SizeIs(1));
  ASSERT_THAT(all.at("clients").at(0).at("links"), SizeIs(1));
  const auto& link = all.at("clients").at(0).at("links").at(0);
  EXPECT_EQ(link.at("server"), "dac/1");
  EXPECT_EQ(link.at("client_state"), "open");
  EXPECT_EQ(link.at("server_state"), "open");
  EXPECT_EQ(link.at("requests"), (nlohmann::json{{"sent", 2}, {"taken", 1}, {"waiting", 1}}));
  EXPECT_EQ(link.at("replies"), (nlohmann::json{{"sent", 1}, {"taken", 0}, {"waiting", 1}}));
  EXPECT_EQ(link.at("unanswered"), 2);
}

TEST_F(ReportTest, ListsAClientThatWaitsForItsServer) {
  dispatcher_ = std::make_unique<Dispatcher>(backplane_);
  MessageClient client(*dispatcher_, [](const Message&) {});
  client.bind("later", 3);
  while (client.notConnectedBecause().find("not running") == std::string::npos)
    dispatcher_->runOnce(Deadline::after(100us));
  while (ls().at("waiting").empty()) dispatcher_->runOnce(Deadline::after(100us));

  const auto all = ls();
  const auto text = run({"ls"}).out;
  const auto routers = run({"mrr", "--interval", "1ms"}).out;

  EXPECT_EQ(all.at("waiting"),
            (nlohmann::json{{{"server", "later"}, {"location", 3}, {"pid", ::getpid()}}}));
  EXPECT_THAT(text, AllOf(HasSubstr("no server\n"), HasSubstr("  later@3 (waiting)\n")));
  EXPECT_THAT(routers,
              HasSubstr("   Server later@3 has 1 client. bindState waiting for the server\n"));
}

TEST_F(ReportTest, ReportsADeadServerAsDead) {
  Victim victim("serve", backplane_.name());
  ASSERT_EQ(victim.line(), "open");
  EXPECT_EQ(entryOf(ls().at("servers"), "name", "echo").at("state"), "alive");

  victim.end(SIGKILL);

  EXPECT_EQ(entryOf(ls().at("servers"), "name", "echo").at("state"), "dead");
  EXPECT_THAT(inOneLine(run({"mrr", "--interval", "1ms"}).out),
              HasSubstr("] dead (removed by the next program that attaches) queueSize 32 "));
  EXPECT_THAT(run({"msr", "echo"}).out, HasSubstr("              state dead, pid "));
  static_cast<void>(backplane_.removeDead());
}

TEST_F(ReportTest, ReportsAStoppedProcessAsStopped) {
  Victim victim("serve", backplane_.name());
  ASSERT_EQ(victim.line(), "open");
  // After an answer it handles SIGTERM, too.
  ASSERT_TRUE(SyncClient(backplane_, "echo").call(Float64Message(), 10min));

  victim.stop();

  EXPECT_EQ(entryOf(ls().at("servers"), "name", "echo").at("state"), "stopped");
  victim.signal(SIGCONT);
  int status = 0;
  ASSERT_EQ(::waitpid(victim.pid(), &status, WCONTINUED), victim.pid());
  EXPECT_EQ(entryOf(ls().at("servers"), "name", "echo").at("state"), "alive");
  EXPECT_EQ(victim.end(SIGTERM), 0);
}

TEST_F(ReportTest, AServerThatTakesNothingWhileRequestsWaitIsStalled) {
  openServer("echo");
  connect();
  EXPECT_EQ(ls().at("servers").at(0).at("state"), "alive");
  for (int i = 0; i < 3; ++i) ASSERT_EQ(send(), SendResult::sent);

  EXPECT_EQ(ls().at("servers").at(0).at("state"), "stalled");
  EXPECT_THAT(run({"ls"}).out,
              testing::ContainsRegex("  echo +stalled +[0-9]+ +tools_test +1 +3 +0 "));
  handle(3);
  const auto now = ls();
  EXPECT_EQ(now.at("servers").at(0).at("state"), "alive");
  EXPECT_EQ(now.at("clients").at(0).at("state"), "stalled") << "it receives no replies";
}

// One slot, several slots, a chunk.
TEST_F(ReportTest, TheCmdOfARequestIsShownWhateverItsSize) {
  openServer("dmm");
  connect();
  auto small = Int32Message({.cmd = 1});
  auto medium = client_->alloc<Char8Array>(1);
  auto large = client_->alloc<Char8Array>(1000);
  medium->cmd = 2;
  large->cmd = 3;
  int cmd = 0;
  for (Message* const question : {static_cast<Message*>(&small), static_cast<Message*>(&medium),
                                  static_cast<Message*>(&large)}) {
    ASSERT_EQ(client_->send(std::move(*question)), SendResult::sent);
    Message inWork;
    while (!inWork) inWork = server_->receive();

    EXPECT_EQ(ls().at("servers").at(0).at("handling").at("cmd"), ++cmd);
  }
}

// A server whose only thread works on a request accepts no client and receives nothing: reports and
// clients show why.
TEST_F(ReportTest, ABusyServerIsShownWithItsRequestAndTheTime) {
  openServer("dmm");
  connect();
  auto question = client_->alloc<Char8Array>(1);
  question->cmd = 3;
  ASSERT_EQ(client_->send(std::move(question)), SendResult::sent);
  Message inWork;
  while (!inWork) inWork = server_->receive();

  const auto now = ls().at("servers").at(0);
  EXPECT_EQ(now.at("state"), "busy");
  EXPECT_EQ(now.at("handling").at("type"), "char8Array");
  EXPECT_EQ(now.at("handling").at("cmd"), 3);
  EXPECT_GT(now.at("handling").at("since_s"), 0);
  EXPECT_THAT(run({"ls"}).out,
              testing::ContainsRegex(
                  "  dmm +busy +(.*\n)+  busy: dmm, with char8Array cmd=3 for [0-9.]+ [mun]?s\n"));
  EXPECT_THAT(
      run({"msr"}).out,
      testing::ContainsRegex("  state busy with char8Array cmd=3 for [0-9.]+ [mun]?s, pid "));

  Dispatcher another(backplane_);
  MessageClient newcomer(another, [](const Message&) {});
  newcomer.bind("dmm", 0);
  while (newcomer.notConnectedBecause().find("busy") == std::string::npos)
    another.runOnce(Deadline::after(100us));
  EXPECT_THAT(newcomer.notConnectedBecause(),
              MatchesRegex("server \"dmm\" is busy with a request, char8Array cmd=3, since "
                           "[0-9]{4}-[0-9]{2}-[0-9]{2} "
                           "[0-9]{2}:[0-9]{2}:[0-9]{2}, and has not accepted the client yet"));

  EXPECT_EQ(server_->reply(std::move(inWork)), ReplyResult::sent);
  while (!newcomer.isConnected()) {
    EXPECT_FALSE(server_->handleOne());
    another.runOnce(Deadline::after(100us));
  }
  EXPECT_EQ(ls().at("servers").at(0).at("state"), "alive");
}

TEST_F(ReportTest, RatesAreThoseBetweenTheSnapshots) {
  const EchoThread echo(backplane_, "echo");
  Tool load({"call", "echo", "int32", "--count", "1000000000", "--timeout", "100"},
            backplane_.name());
  const auto isMoving = [](const nlohmann::json& entry) {
    return entry.at("received_per_s") > 0 && entry.at("sent_per_s") > 0;
  };

  for (auto all = ls(); all.at("clients").empty() || !isMoving(all.at("clients").at(0)) ||
                        !isMoving(all.at("servers").at(0));)
    all = ls();

  load.signal(SIGINT);
  EXPECT_EQ(load.end().status, 0);
}

TEST_F(ReportTest, SaysThatABackplaneHasNoProcessAndWhichOnesHave) {
  const EchoThread echo(backplane_, "echo");
  const TestBackplane dead;
  Victim victim("serve", dead.name());
  ASSERT_EQ(victim.line(), "open");
  victim.end(SIGKILL);

  const auto ended = run({"ls", "--backplane", backplane_.name() + "-typo"});

  EXPECT_THAT(ended.out, testing::StartsWith("backplane " + backplane_.name() +
                                             "-typo has no process; use one of "));
  const auto advised = ended.out.substr(ended.out.find("; use one of"));
  EXPECT_THAT(advised, HasSubstr(backplane_.name()));
  EXPECT_THAT(advised, Not(HasSubstr(dead.name())));
  static_cast<void>(dead.removeDead());
}

}  // namespace
}  // namespace mpf::test
