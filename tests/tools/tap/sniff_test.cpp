// SPDX-License-Identifier: MIT
// `mpf sniff`: the bytes between an instrument on a pseudo-terminal and its serial server, in each
// format.
#include <regex>

#include "server/programs/serial_server/sniff_source.h"
#include "server/programs/sniff/sniff_server.h"
#include "tests/server/programs/serial_server/serial_fixture.h"
#include "tests/tools/tools_fixture.h"

namespace mpf::test {
namespace {

using namespace serial;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::MatchesRegex;

class SniffToolTest : public SerialServerTest {
 protected:
  static constexpr SniffBatching kNever{.maxAge = 24h, .largeBytes = 1'000'000};

  void SetUp() override { start(); }
  void listen(const SniffBatching& batching = {}) {
    sniff_ = std::make_unique<SniffServer>(backplane_, "serial[0]", ServerOptions(),
                                           sniffSourceOf(port_), log_, batching);
    sniff_->start([] { ADD_FAILURE() << "the sniff server failed"; });
  }
  // Returns when the tool listens, and both it and the server have noticed.
  std::unique_ptr<Tool> sniff(std::vector<std::string> more = {}) {
    std::vector<std::string> arguments{"sniff", "serial[0]"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    auto tool = std::make_unique<Tool>(arguments, backplane_.name());
    waitForListener();
    while (tool->err().find("listening to") == std::string::npos) std::this_thread::yield();
    return tool;
  }
  void waitForListener() const {
    while (sniff_->listeners() == 0) std::this_thread::yield();
  }
  // Sends "ECHO <word>\n" to the instrument, which answers "<word>\r\n".
  void talk(const std::string& word) {
    EXPECT_EQ(ask("ECHO " + word + "\n", fieldsOf(cmdWriteRead)).text, word + "\r\n");
  }
  void TearDown() override {
    SerialServerTest::TearDown();
    sniff_.reset();
  }

  std::unique_ptr<SniffServer> sniff_;
};

// All bytes are recorded before they are read, so that a slow machine adds no pauses.
TEST_F(SniffToolTest, PrintsALineForEachTurn) {
  listen(kNever);
  const auto tool = sniff();
  talk("1.25");
  talk("x");

  tool->signal(SIGINT);

  const auto ended = tool->end();
  EXPECT_EQ(ended.status, 0);
  const std::string times = "[0-2][0-9]:[0-5][0-9]:[0-6][0-9]\\.[0-9]{3} +\\+[0-9]+\\.[0-9] ms  ";
  EXPECT_THAT(ended.out,
              MatchesRegex(times + "T  ECHO 1\\.25\\\\n\n" + times + "R  1\\.25\\\\r\\\\n\n" +  //
                           times + "T  ECHO x\\\\n\n" + times + "R  x\\\\r\\\\n\n"));
  EXPECT_EQ(ended.err,
            "mpf sniff: listening to \"serial[0]\"\nmpf sniff: 26 bytes seen, 0 missing\n");
}

TEST_F(SniffToolTest, PrintsAnIncompleteLineAtAPause) {
  listen();
  const auto tool = sniff({"--format", "manual"});

  talk("1.25");

  std::string hex;
  const std::regex byte("[TR][0-9A-F]{2} ");
  while (hex.size() < 16 * 4) {
    const auto line = tool->line();
    for (std::sregex_iterator word(line.begin(), line.end(), byte); word != std::sregex_iterator();
         ++word)
      hex += word->str();
  }
  EXPECT_EQ(hex, "T45 T43 T48 T4F T20 T31 T2E T32 T35 T0A R31 R2E R32 R35 R0D R0A ");
}

TEST_F(SniffToolTest, JsonIsAnObjectForEachByte) {
  listen();
  const auto tool = sniff({"--json"});
  const auto before = Clock::nowNs();

  talk("a");

  std::string text;
  auto lastNs = before;
  for (int i = 0; i < 10; ++i) {
    const auto byte = nlohmann::json::parse(tool->line());
    text += byte.at("kind").get<std::string>() + static_cast<char>(byte.at("value").get<int>());
    EXPECT_GE(byte.at("at_ns"), lastNs);
    lastNs = byte.at("at_ns");
  }
  EXPECT_EQ(text, "TETCTHTOT TaT\nRaR\rR\n");
  EXPECT_LE(lastNs, Clock::nowNs());
}

TEST_F(SniffToolTest, EndsAfterTheGivenTime) {
  listen();

  // On a busy host, the time may end before the server has answered.
  Ended ended;
  for (double seconds = 0.3; ended.err.find("listening") == std::string::npos; seconds *= 2)
    ended = runTool({"sniff", "serial[0]", std::to_string(seconds)}, backplane_.name());

  EXPECT_EQ(ended.status, 0);
  EXPECT_EQ(ended.err,
            "mpf sniff: listening to \"serial[0]\"\nmpf sniff: 0 bytes seen, 0 missing\n");
}

// Bytes that the server has not sent at the end are still shown.
TEST_F(SniffToolTest, PrintsTheLastBytesAtItsEnd) {
  listen(kNever);
  for (const int signal : {SIGINT, SIGTERM}) {
    const auto tool = sniff({"--format", "manual"});
    talk("12");

    tool->signal(signal);

    const auto ended = tool->end();
    EXPECT_EQ(ended.status, 0);
    EXPECT_EQ(ended.out, "T45 T43 T48 T4F T20 T31 T32 T0A R31 R32 ECHO 12.12\nR0D R0A ..\n");
    EXPECT_THAT(ended.err, HasSubstr("12 bytes seen, 0 missing\n"));
    while (sniff_->listeners() != 0) std::this_thread::yield();
  }
}

// A server that is stopped in a debugger.
TEST_F(SniffToolTest, ASecondSignalEndsTheWaitForAServerThatDoesNotAnswer) {
  MessageServer server(backplane_, "serial[0].sniff");
  const auto next = [&] {
    for (;;) {
      server.waitForMessage();
      if (auto request = server.receive()) return request;
    }
  };
  Tool tool({"sniff", "serial[0]"}, backplane_.name());
  auto start = next();
  start.tryAs<Int32>()->status = sniffStatusOK;
  ASSERT_EQ(server.reply(std::move(start)), ReplyResult::sent);
  while (tool.err().find("listening to") == std::string::npos) std::this_thread::yield();

  tool.signal(SIGINT);
  const auto stop = next();
  EXPECT_EQ(stop.tryAs<Int32>()->cmd, cmdSniffStop);
  tool.signal(SIGINT);

  const auto ended = tool.end();
  EXPECT_EQ(ended.status, 0);
  EXPECT_THAT(ended.err,
              HasSubstr("\"serial[0].sniff\" did not answer: its last bytes may be missing\n"));
}

TEST_F(SniffToolTest, ListensAgainAfterARestartOfTheServer) {
  listen();
  const auto tool = sniff();
  talk("before");
  EXPECT_THAT(tool->lineWith("R  "), HasSubstr("R  b"));

  sniff_.reset();
  listen();
  waitForListener();
  talk("after");

  EXPECT_NE(tool->lineWith("R  a"), "");
  tool->signal(SIGINT);
  EXPECT_THAT(tool->end().err, ContainsRegex("listening to \"serial\\[0\\]\"\nmpf sniff: .*\nmpf "
                                             "sniff: listening to \"serial\\[0\\]\"\n"));
}

TEST_F(SniffToolTest, NamesAnAbsentServer) {
  const auto ended = runTool({"sniff", "nobody", "0.1"}, backplane_.name());

  EXPECT_EQ(ended.status, 1);
  EXPECT_THAT(ended.err,
              ContainsRegex("^mpf sniff: server \"nobody.sniff\" at location 0 is not running.*"
                            "; check with `mpf ls` that it is a serial server"));
}

TEST_F(SniffToolTest, ReportsAServerThatRefusesToSniff) {
  MessageServer server(backplane_, "closed.sniff");
  server.on<Int32>([](Int32& request) { request.status = sniffStatusError; });
  std::thread thread([&] { server.run(); });

  const auto ended = runTool({"sniff", "closed"}, backplane_.name());

  EXPECT_EQ(ended.status, 1);
  EXPECT_THAT(ended.err,
              HasSubstr("mpf sniff: \"closed.sniff\" refused to start sniffing: status 3\n"));
  server.interrupt();
  thread.join();
}

TEST_F(SniffToolTest, ReportsAServerOfAnotherKind) {
  MessageServer server(backplane_, "other.sniff");
  std::thread thread([&] { server.run(); });

  const auto ended = runTool({"sniff", "other"}, backplane_.name());

  EXPECT_EQ(ended.status, 1);
  EXPECT_THAT(ended.err, HasSubstr("mpf sniff: \"other.sniff\" refused a request to sniff; check "
                                   "with `mpf ls` that it is a serial server\n"));
  server.interrupt();
  thread.join();
}

// The line is quiet, so the tool does not write to the pipe.
TEST_F(SniffToolTest, EndsWithTheProgramThatReadsItsOutput) {
  listen();
  const auto tool = sniff();

  tool->closeOutput();

  const auto ended = tool->end();
  EXPECT_EQ(ended.status, 0);
  EXPECT_THAT(ended.err, HasSubstr("0 bytes seen, 0 missing\n"));
}

}  // namespace
}  // namespace mpf::test
