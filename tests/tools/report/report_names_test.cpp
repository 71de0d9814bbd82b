// SPDX-License-Identifier: MIT
// ls, mrr, msr, inspect: names in any language, hostile and long names, and long lists.
#include <algorithm>

#include "tests/tools/report/report_fixture.h"

namespace mpf::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::SizeIs;
using testing::StartsWith;

TEST_F(ReportTest, AlignsNamesInAnyLanguage) {
  const MessageServer oven(backplane_, "Ofen-Süd [°C]", {.location = 0});
  const MessageServer plain(backplane_, "oven", {.location = 0});

  const auto lines = linesOf(run({"ls"}).out);

  ASSERT_THAT(lines, SizeIs(5));
  EXPECT_THAT(lines[1], StartsWith("  SERVER         STATE"));
  EXPECT_THAT(lines[2], StartsWith("  Ofen-Süd [°C]  alive"));
  EXPECT_THAT(lines[3], StartsWith("  oven           alive"));
}

TEST_F(ReportTest, EscapesANameThatIsNotUtf8) {
  const MessageServer server(backplane_, "a\xff", {.location = 0});

  EXPECT_EQ(ls().at("servers").at(0).at("name"), R"(a\xff)");
  EXPECT_THAT(run({"ls"}).out, HasSubstr(R"(  a\xff )"));
}

// A server refuses control characters in its name, but not characters that change the direction of
// a text.
TEST_F(ReportTest, EscapesFormatCharactersInNamesAndFindsEscapedNames) {
  const std::string name = "a\u202eb\u200b";
  const std::string shown = R"(a\u202eb\u200b)";
  openServer(name);
  connect();

  for (const std::vector<std::string>& report :
       std::vector<std::vector<std::string>>{{"ls"},
                                             {"mrr", "--interval", "1ms"},
                                             {"msr"},
                                             {"inspect"},
                                             {"top", "--batch", "1"},
                                             {"ls", "--json"},
                                             {"inspect", "--json"}}) {
    const auto ended = run(report);

    EXPECT_THAT(ended.out,
                AllOf(HasSubstr("a\\"), Not(HasSubstr("\u202e")), Not(HasSubstr("\u200b"))))
        << report.front();
    EXPECT_TRUE(report.back() != "--json" || nlohmann::json::accept(ended.out)) << ended.out;
  }
  for (const auto& given : {name, shown}) {
    EXPECT_THAT(run({"msr", given}).out, StartsWith(shown + "\n"));
    EXPECT_EQ(run({"inspect", given}).status, 0);
  }
  EXPECT_EQ(run({"msr", "x\u202ey"}).err,
            "mpf msr: no server \"x\\u202ey\"; `mpf ls` lists the servers\n");
}

TEST_F(ReportTest, DistinguishesServersOfOneNameAtTwoLocations) {
  openServer("dac");
  const EchoThread other(backplane_, "dac", {.location = 2});
  connect();
  MessageClient second(*dispatcher_, [](const Message&) {});
  second.bind("dac", 2);
  while (!second.isConnected()) dispatcher_->runOnce(Deadline::after(100us));

  const auto text = run({"ls"}).out;
  const auto routers = run({"mrr", "--interval", "1ms"}).out;

  EXPECT_THAT(text, HasSubstr("dac, dac@2\n"));
  EXPECT_THAT(routers, AllOf(HasSubstr("   Server dac has 1 client. bindState connected\n   Server "
                                       "dac@2 has 1 client. bindState connected\n"),
                             HasSubstr(" 2 dac@2[")));
}

TEST_F(ReportTest, ShowsAProcessWithThousandsOfClientsInOneLine) {
  const EchoThread echo(backplane_, "echo");
  dispatcher_ = std::make_unique<Dispatcher>(backplane_);
  std::vector<std::unique_ptr<MessageClient>> clients;
  for (int i = 0; i < 3000; ++i) {
    clients.push_back(std::make_unique<MessageClient>(*dispatcher_, [](const Message&) {}));
    clients.back()->bind("echo", 0);
  }
  for (const auto& client : clients) ASSERT_TRUE(client->connectWait(60s));

  const auto text = run({"ls"}).out;

  EXPECT_THAT(text, HasSubstr("  echo x 3000\n"));
  EXPECT_THAT(run({"mrr", "--interval", "1ms"}).out,
              HasSubstr("   Server echo has 3000 clients. bindState connected\n"));
}

TEST_F(ReportTest, ShowsSixServersOfAClient) {
  std::vector<std::unique_ptr<EchoThread>> servers;
  std::vector<std::unique_ptr<MessageClient>> clients;
  dispatcher_ = std::make_unique<Dispatcher>(backplane_);
  for (char letter = 'a'; letter < 'j'; ++letter) {
    servers.push_back(std::make_unique<EchoThread>(backplane_, std::string(1, letter)));
    clients.push_back(std::make_unique<MessageClient>(*dispatcher_, [](const Message&) {}));
    clients.back()->bind(std::string(1, letter));
    ASSERT_TRUE(clients.back()->connectWait(60s));
  }

  const auto text = run({"ls"}).out;

  EXPECT_THAT(inOneLine(text), HasSubstr(" a, b, c, d, e, f, 3 more"));
  clients.clear();
}

std::size_t widestOf(const std::string& text) {
  std::size_t widest = 0;
  for (const auto& line : linesOf(text)) widest = std::max(widest, line.size());
  return widest;
}

// Reports do not cut names of the maximum length.
TEST_F(ReportTest, LongNamesFitIntoEightyColumns) {
  const std::string name = "a-server-" + std::string(54, 'x');
  openServer(name);
  dispatcher_ = std::make_unique<Dispatcher>(
      backplane_, DispatcherOptions{WaitMode::adaptive, "a-client-" + std::string(54, 'y')});
  connect();
  MessageClient second(*dispatcher_, [](const Message&) {});
  second.bind("another-" + std::string(54, 'z'), -2'000'000'000);
  while (ls().at("waiting").empty()) dispatcher_->runOnce(Deadline::after(100us));

  const auto list = run({"ls"}).out;
  const auto server = run({"msr", name}).out;
  const auto routers = run({"mrr", "--interval", "1ms"}).out;
  const auto summary = run({"inspect"}).out;

  EXPECT_LE(widestOf(routers), 80U) << routers;
  EXPECT_LE(widestOf(summary), 80U) << summary;
  EXPECT_THAT(routers, AllOf(HasSubstr(name + "["), HasSubstr("Server " + name),
                             HasSubstr("a-client-" + std::string(54, 'y') + "["),
                             HasSubstr("another-" + std::string(54, 'z'))));
  EXPECT_THAT(summary, AllOf(HasSubstr("server " + name + "\n"),
                             HasSubstr("client a-client-" + std::string(54, 'y') + "\n")));
  EXPECT_LE(widestOf(list), 80U) << list;
  EXPECT_LE(widestOf(server), 80U) << server;
  EXPECT_THAT(
      list, AllOf(HasSubstr("  " + name + "\n"), HasSubstr("  a-client-" + std::string(54, 'y'))));
  EXPECT_THAT(server, HasSubstr("\n  a-client-" + std::string(54, 'y') + "["));
  dispatcher_->runOnce(Deadline::after(1us));
}

}  // namespace
}  // namespace mpf::test
