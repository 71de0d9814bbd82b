// SPDX-License-Identifier: MIT
// `mpf call`: messages of every type, statistics, and the reasons why there is no reply.
#include "tests/tools/tools_fixture.h"

namespace mpf::test {
namespace {

using testing::AllOf;
using testing::ContainsRegex;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using testing::StartsWith;

class CallTest : public ToolsTest {
 protected:
  // Runs mpf call with a timeout that only the watchdog ends.
  [[nodiscard]] Ended call(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "call");
    arguments.insert(arguments.end(), {"--timeout", "100"});
    return run(std::move(arguments));
  }
  // A server that a thread of the test runs, with the handlers of `prepare`.
  template <class Prepare>
  void serve(Prepare prepare, const ServerOptions& options = {}) {
    server_ = std::make_unique<MessageServer>(backplane_, "special", options);
    prepare(*server_);
    thread_ = std::thread([this] { server_->run(); });
  }
  void TearDown() override {
    if (thread_.joinable()) {
      server_->interrupt();
      thread_.join();
    }
    server_.reset();
    ToolsTest::TearDown();
  }

  std::vector<Message> kept_;  // requests that the server never answers
  std::unique_ptr<MessageServer> server_;
  std::thread thread_;
};

struct Echoed {
  std::vector<std::string> words;  // type and fields
  std::string reply;
};

TEST_F(CallTest, EchoesMessagesOfEveryType) {
  const EchoThread echo(backplane_, "echo");
  const std::vector<Echoed> all{
      {{"int32", "timeout=1", "cmd=-2", "status=3", "address=0x10", "extra=5", "value=-2147483648"},
       "int32 timeout=1 cmd=-2 status=3 address=16 extra=5 value=-2147483648"},
      {{"int32Array", "address=7", "value=1,-2,3"},
       "int32Array timeout=0 cmd=0 status=0 address=7 extra=0 value=1,-2,3"},
      {{"float64", "value=1.25e-3"},
       "float64 timeout=0 cmd=0 status=0 address=0 extra=0 value=0.00125"},
      {{"float64Array", "value=1,nan,-inf"},
       "float64Array timeout=0 cmd=0 status=0 address=0 extra=0 value=1,nan,-inf"},
      {{"char8Array", "value=*IDN?\\n", "eomString=\\r\\n", "numberRetrys=2"},
       "char8Array timeout=0 cmd=0 status=0 address=0 extra=0 numberRetrys=2 eomLen=2 "
       "eomString=\"\\r\\n\" value=\"*IDN?\\n\""},
      {{"serialConfig", "baud=19200", "parity=E"},
       "serialConfig baud=19200 stopBits=0 bitsPerChar=0 parity=E flowControl=0"},
      {{"outOfBand", "value=9"}, "outOfBand timeout=0 cmd=0 status=0 address=0 extra=0 value=9"},
      {{"user", "value=00ff7f"}, "user value=00ff7f"},
      {{"int32", "clientType=4", "clientExtra=5"},
       "int32 timeout=0 cmd=0 status=0 address=0 extra=0 value=0 clientType=4 clientExtra=5"},
  };
  for (const auto& [words, reply] : all) {
    std::vector<std::string> arguments{"echo"};
    arguments.insert(arguments.end(), words.begin(), words.end());

    const auto ended = call(arguments);

    EXPECT_EQ(ended.status, 0) << ended.err;
    EXPECT_EQ(ended.out, reply + "\n");
    EXPECT_THAT(ended.err, IsEmpty());
  }
}

TEST_F(CallTest, ShortensLongArraysWithoutPrint) {
  const EchoThread echo(backplane_, "echo");
  std::string value = "0";
  for (int i = 1; i < 5000; ++i) value += "," + std::to_string(i);

  const auto brief = call({"echo", "int32Array", "value=" + value});
  const auto all = call({"echo", "int32Array", "value=" + value, "--print"});

  EXPECT_THAT(brief.out, EndsWith(",62,63,... (5000)\n"));
  EXPECT_THAT(all.out, EndsWith(" value=" + value + "\n"));
}

TEST_F(CallTest, PrintsTheReplyAsJson) {
  const EchoThread echo(backplane_, "echo");

  const auto ended = call({"echo", "char8Array", "value=a\\x00\\xffb", "--json"});

  EXPECT_EQ(ended.status, 0);
  const auto all = nlohmann::json::parse(ended.out);
  EXPECT_EQ(all.at("server"), "echo");
  EXPECT_EQ(all.at("location"), 0);
  EXPECT_EQ(all.at("replied"), 1);
  EXPECT_EQ(all.at("failed"), 0);
  EXPECT_THAT(all.at("why"), SizeIs(0));
  ASSERT_THAT(all.at("replies"), SizeIs(1));
  EXPECT_EQ(all.at("replies").at(0).at("type"), "char8Array");
  EXPECT_EQ(all.at("replies").at(0).at("value"), std::string("a\0\u00ffb", 5));
  EXPECT_GT(all.at("max_ns"), 0);
}

TEST_F(CallTest, PrintsStatisticsOfManyCalls) {
  const EchoThread echo(backplane_, "echo");

  const auto ended = call({"echo", "float64", "value=1", "--count", "200"});

  EXPECT_EQ(ended.status, 0);
  EXPECT_THAT(ended.out, testing::MatchesRegex(
                             "200 replied, 0 did not; p50 [0-9.]+ [mun]?s, p99 [0-9.]+ [mun]?s, "
                             "p99\\.9 [0-9.]+ [mun]?s, max [0-9.]+ [mun]?s\n"));
}

TEST_F(CallTest, PrintsStatisticsOfManyCallsAsJson) {
  const EchoThread echo(backplane_, "echo");

  const auto brief = nlohmann::json::parse(call({"echo", "int32", "--count", "200", "--json"}).out);
  const auto all =
      nlohmann::json::parse(call({"echo", "int32", "--count", "20", "--json", "--print"}).out);

  EXPECT_EQ(brief.at("replied"), 200);
  EXPECT_THAT(brief.at("replies"), SizeIs(0));
  EXPECT_THAT(all.at("replies"), SizeIs(20));
  EXPECT_LE(brief.at("p50_ns"), brief.at("p99_ns"));
  EXPECT_LE(brief.at("p99_ns"), brief.at("p999_ns"));
  EXPECT_LE(brief.at("p999_ns"), brief.at("max_ns"));
}

TEST_F(CallTest, AReplyThatReportsAnErrorIsAReply) {
  serve(
      [](MessageServer& server) { server.on<Int32>([](Int32& request) { request.status = -1; }); });

  const auto ended = call({"special", "int32"});

  EXPECT_EQ(ended.status, 0);
  EXPECT_THAT(ended.out, HasSubstr(" status=-1 "));
}

TEST_F(CallTest, AnUnknownTypeIsAnErrorThatListsAllTypes) {
  const auto ended = call({"echo", "int64"});

  EXPECT_EQ(ended.status, 2);
  EXPECT_EQ(ended.err,
            "mpf call: int64 is not a message type; use one of int32, int32Array, float64, "
            "float64Array, char8Array, serialConfig, "
            "outOfBand, user\n");
}

TEST_F(CallTest, RefusesTypesThatOnlyMpfItselfSends) {
  for (const std::string type : {"connect", "requestFate"}) {
    const auto ended = call({"echo", type});

    EXPECT_EQ(ended.status, 2);
    EXPECT_THAT(ended.err,
                StartsWith("mpf call: " + type +
                           " is a message type that only MPF itself sends; use one of int32, "));
  }
}

TEST_F(CallTest, AWrongFieldIsAnErrorThatListsAllFields) {
  const std::vector<Echoed> wrong{
      {{"int32", "adress=3"},
       "mpf call: int32: unknown field \"adress\"; use one of timeout, cmd, status, address, "
       "extra, value, "
       "clientType, clientExtra\n"},
      {{"int32", "value"}, "mpf call: int32: \"value\" is not field=value\n"},
  };
  for (const auto& [words, text] : wrong) {
    std::vector<std::string> arguments{"call", "echo"};
    arguments.insert(arguments.end(), words.begin(), words.end());

    const auto ended = run(arguments);

    EXPECT_EQ(ended.status, 2);
    EXPECT_EQ(ended.err, text);
  }
  const auto ended = call({"echo", "int32", "value=2147483648"});
  EXPECT_EQ(ended.status, 2);
  EXPECT_THAT(ended.err, AllOf(HasSubstr("value"), HasSubstr("2147483648"),
                               HasSubstr("an integer from -2147483648 to 2147483647")));
}

TEST_F(CallTest, SaysWhyALocationCannotBeReached) {
  const auto ended = run({"call", "nobody", "int32", "--location", "7", "--timeout", "0.05"});

  EXPECT_THAT(ended.err,
              HasSubstr("server \"nobody\" at location 7 is not running or not reachable: no "
                        "router of this host has a remote with location 7; `mpf ls` shows"));
}

TEST_F(CallTest, SaysHowAServerAdmitsAnotherUser) {
  constexpr uid_t kNobody = 65534;
  if (::geteuid() != 0) GTEST_SKIP() << "only root can run as another user";
  if (Tool({"--help"}, "", kNobody).end().status != 0)
    GTEST_SKIP() << "other users cannot execute " << MPF_TEST_TOOL;
  const EchoThread echo(backplane_, "echo");

  const auto ended =
      Tool({"call", "echo", "int32", "--timeout", "0.05"}, backplane_.name(), kNobody).end();

  EXPECT_EQ(ended.status, 1);
  EXPECT_THAT(ended.err,
              HasSubstr("Permission denied; start the server with --mode 0660 --group "));
}

TEST_F(CallTest, NamesAnAbsentServer) {
  const auto ended = run({"call", "nobody", "int32", "--timeout", "0.05"});

  EXPECT_EQ(ended.status, 1);
  EXPECT_THAT(ended.out, IsEmpty());
  EXPECT_THAT(ended.err, ContainsRegex("^mpf call: not sent: not connected: server \"nobody\" at "
                                       "location 0 is not running.*; `mpf ls` shows"));
}

TEST_F(CallTest, TheServerMayStartWithinTheTimeout) {
  Tool tool({"call", "echo", "int32", "value=3", "--timeout", "100"}, backplane_.name());
  while (ls().at("waiting").empty()) continue;

  const EchoThread echo(backplane_, "echo");

  EXPECT_THAT(tool.end().out, EndsWith("value=3\n"));
}

TEST_F(CallTest, ATooLargeMessageIsRefusedWithTheLimit) {
  const EchoThread echo(backplane_, "echo", {.maxMessageBytes = 1000});

  const auto ended = call({"echo", "char8Array", "value=" + std::string(1000, 'x')});

  EXPECT_EQ(ended.status, 1);
  EXPECT_EQ(ended.err, "mpf call: not sent: larger than the server allows: " +
                           std::to_string(1000 + sizeof(Char8Array)) +
                           " bytes, the limit is 1000\n");
}

TEST_F(CallTest, FindsAServerAtAnotherLocation) {
  const EchoThread echo(backplane_, "echo", {.location = 5});

  EXPECT_EQ(call({"echo", "int32", "--location", "5"}).status, 0);
  EXPECT_THAT(
      run({"call", "echo", "int32", "--timeout", "0.05"}).err,
      HasSubstr("at location 0 is not running; it runs at location 5: --location 5; `mpf "));
}

TEST_F(CallTest, ATypeWithoutAHandlerIsRefused) {
  serve([](MessageServer& server) { server.on<Int32>([](Int32&) {}); });

  const auto ended = call({"special", "float64"});

  EXPECT_EQ(ended.status, 1);
  EXPECT_EQ(ended.err,
            "mpf call: no reply: refused (the server has no handler for messages of this type, or "
            "dropped the request)\n");
}

// Whether the server has taken the request by then depends on the speed of the machine.
TEST_F(CallTest, ARequestWithoutAReplyInTimeHasAFate) {
  serve([&](MessageServer& server) {
    server.on<Int32>([&](Int32Message&& request) { kept_.push_back(std::move(request)); });
  });

  Ended ended;
  auto timeout = 0.5;
  do {
    ended = run({"call", "special", "int32", "--timeout", std::to_string(timeout)});
    timeout *= 2;
  } while (ended.err.starts_with("mpf call: not sent: not connected: "));

  EXPECT_EQ(ended.status, 1);
  EXPECT_THAT(
      ended.err,
      testing::AnyOf(
          testing::MatchesRegex(
              "mpf call: no reply within .*: outcomeUnknown \\(the server may have "
              "taken the request and carried it out\\)\n"),
          StartsWith("mpf call: no reply: expired (the server did not take the request in time")));
}

TEST_F(CallTest, CountsTheReasonsOfFailedCalls) {
  serve([](MessageServer& server) {
    server.on<Int32>([count = 0, &server](Int32Message&& request) mutable {
      if (++count % 3 == 0) server.refuse(std::move(request));
      else static_cast<void>(server.reply(std::move(request)));
    });
  });

  const auto text = call({"special", "int32", "--count", "9"});
  const auto json = call({"special", "int32", "--count", "9", "--json"});

  EXPECT_EQ(text.status, 1);
  EXPECT_THAT(text.out, StartsWith("6 replied, 3 did not; p50 "));
  EXPECT_THAT(text.err,
              AllOf(StartsWith("mpf call: no reply: refused ("), EndsWith(" (3 times)\n")));
  EXPECT_EQ(json.status, 1);
  const auto all = nlohmann::json::parse(json.out);
  EXPECT_EQ(all.at("failed"), 3);
  ASSERT_THAT(all.at("why"), SizeIs(1));
  EXPECT_EQ(all.at("why").begin().value(), 3);
}

TEST_F(CallTest, ASignalEndsALoopWithItsStatistics) {
  const EchoThread echo(backplane_, "echo");
  for (const int signal : {SIGINT, SIGTERM}) {
    Tool tool({"call", "echo", "int32", "value=3", "--count", "1000000000", "--print", "--timeout",
               "100"},
              backplane_.name());
    EXPECT_THAT(tool.line(), EndsWith("value=3"));

    tool.signal(signal);

    const auto ended = tool.end();
    EXPECT_EQ(ended.status, 0);
    EXPECT_THAT(ended.out, ContainsRegex("(^|\n)[0-9]+ replied, 0 did not; "));
  }
}

TEST_F(CallTest, ASignalEndsALoopDuringAPause) {
  const EchoThread echo(backplane_, "echo");
  Tool tool({"call", "echo", "int32", "--count", "2", "--interval", "1000000", "--print",
             "--timeout", "100"},
            backplane_.name());
  EXPECT_THAT(tool.line(), StartsWith("int32 "));

  tool.signal(SIGINT);

  EXPECT_THAT(tool.end().out, StartsWith("1 replied, 0 did not; "));
}

TEST_F(CallTest, FollowPrintsMessagesAfterTheReply) {
  serve([](MessageServer& server) {
    server.on<Int32>([&](Int32Message&& request) {
      for (int i = 0; i < 3; ++i) {
        auto reply = server.allocReplyMessage<Int32>(request);
        reply->value = i;
        static_cast<void>(server.reply(std::move(reply)));
      }
      static_cast<void>(server.reply(std::move(request)));
    });
  });
  Tool tool({"call", "special", "int32", "value=77", "--follow", "1000000", "--timeout", "100"},
            backplane_.name());

  for (const auto* value : {"value=0", "value=1", "value=2", "value=77"})
    EXPECT_THAT(tool.line(), EndsWith(value));
  tool.signal(SIGINT);

  EXPECT_EQ(tool.end().status, 0);
}

}  // namespace
}  // namespace mpf::test
