// SPDX-License-Identifier: MIT
// `mpf tap` and `mpf replay`: read and record messages, and send them again.
#include <filesystem>
#include <regex>

#include <mpf/sync_client.h>

#include "tests/support/victim.h"
#include "tests/tools/tools_fixture.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::MatchesRegex;

class TapTest : public ToolsTest {
 protected:
  void TearDown() override {
    std::filesystem::remove(file_);
    ToolsTest::TearDown();
  }
  // Returns when the tap follows `links` links of the server.
  std::unique_ptr<Tool> tap(std::vector<std::string> more, int links = 1) const {
    std::vector<std::string> arguments{"tap", "echo"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    auto tool = std::make_unique<Tool>(arguments, backplane_.name());
    while (tool->err().find("mpf tap: \"echo\" has " + std::to_string(links)) == std::string::npos)
      std::this_thread::yield();
    return tool;
  }
  static void callMany(SyncClient& client, int from, int to) {
    for (int i = from; i < to; ++i) {
      const auto answer = client.call(Int32Message({.value = i}), 1h);
      ASSERT_TRUE(answer);
    }
  }
  static std::vector<nlohmann::json> objects(const std::string& lines) {
    std::vector<nlohmann::json> all;
    std::istringstream stream(lines);
    for (std::string line; std::getline(stream, line);) all.push_back(nlohmann::json::parse(line));
    return all;
  }
  // The messages of one direction.
  static std::vector<nlohmann::json> messages(const std::vector<nlohmann::json>& all,
                                              const std::string& direction) {
    std::vector<nlohmann::json> some;
    for (const auto& object : all) {
      if (object.value("direction", "") == direction) some.push_back(object.at("message"));
    }
    return some;
  }

  std::string file_ = std::filesystem::temp_directory_path() / (backplane_.name() + ".mpf");
};

TEST_F(TapTest, ShowsRequestsAndTheirReplies) {
  const EchoThread echo(backplane_, "echo");
  SyncClient client(backplane_, "echo");
  callMany(client, 0, 1);
  const auto tool = tap({"--count", "4"});

  callMany(client, 5, 7);

  const auto ended = tool->end();
  EXPECT_EQ(ended.status, 0) << ended.err;
  EXPECT_THAT(ended.err, EndsWith("mpf tap: 4 messages seen, 0 missed\n"));
  const std::string begin = "[0-9:]{8}\\.[0-9]{6}  [0-9a-f]{4}  ";
  const std::string fields = "int32 timeout=0 cmd=0 status=0 address=0 extra=0 value=";
  EXPECT_THAT(
      ended.out,
      MatchesRegex(begin + "--   tools_test\\[[0-9]+\\] and echo: link [0-9a-f]{16}\n" +  //
                   begin + "-> 2   " + fields + "5\n" + begin + "<- 2   " + fields + "5\n" +  //
                   begin + "-> 3   " + fields + "6\n" + begin + "<- 3   " + fields + "6\n"));
}

TEST_F(TapTest, PrintsAReplyNeverBeforeItsRequest) {
  constexpr std::uint64_t kBatch = 20;  // fewer than half a ring: none is missed
  const EchoThread echo(backplane_, "echo");
  SyncClient client(backplane_, "echo");
  callMany(client, 0, 1);
  const auto tool = tap({"--json"});
  EXPECT_THAT(tool->line(), HasSubstr("opened"));

  std::uint64_t lastRequest = 1;
  std::uint64_t lastReply = 1;
  for (std::uint64_t last = 1 + kBatch; last <= 1 + 50 * kBatch; last += kBatch) {
    callMany(client, 0, static_cast<int>(kBatch));
    while (lastReply < last) {
      const auto object = nlohmann::json::parse(tool->line());
      auto& sequence = object.at("direction") == "request" ? lastRequest : lastReply;
      EXPECT_EQ(object.at("requestId"), ++sequence);
      EXPECT_LE(lastReply, lastRequest);
    }
  }
}

// The numbers of seen and missed messages add up to all messages.
TEST_F(TapTest, CountsMissedMessages) {
  const EchoThread echo(backplane_, "echo");
  SyncClient client(backplane_, "echo");
  callMany(client, 0, 1);
  const auto tool = tap({"--poll", "0.1", "--json"});

  callMany(client, 0, 5'000);

  tool->signal(SIGINT);
  const auto ended = tool->end();
  std::smatch numbers;
  ASSERT_TRUE(
      std::regex_search(ended.err, numbers, std::regex("([0-9]+) messages seen, ([0-9]+) missed")))
      << ended.err;
  EXPECT_EQ(std::stoul(numbers[1]) + std::stoul(numbers[2]), 10'000u);
  EXPECT_GT(std::stoul(numbers[2]), 0u);
  EXPECT_EQ(std::stoul(numbers[1]), messages(objects(ended.out), "request").size() +
                                        messages(objects(ended.out), "reply").size());
}

TEST_F(TapTest, ReadsBodiesInPools) {
  const EchoThread echo(backplane_, "echo");
  SyncClient client(backplane_, "echo");
  callMany(client, 0, 1);
  const auto tool = tap({"--json", "--count", "2"});
  auto request = Float64ArrayMessage::allocValue(100'000);
  for (std::size_t i = 0; i < request.value().size(); ++i)
    request.value()[i] = static_cast<double>(i);

  ASSERT_TRUE(client.call(std::move(request), 1h));

  const auto all = objects(tool->end().out);
  for (const auto* direction : {"request", "reply"}) {
    const auto seen = messages(all, direction);
    ASSERT_EQ(seen.size(), 1u);
    EXPECT_EQ(seen[0].at("value").size(), 100'000u);
    EXPECT_EQ(seen[0].at("value").at(99'999), 99'999.0);
  }
}

TEST_F(TapTest, FollowsLaterClientsFromTheirFirstMessage) {
  const EchoThread echo(backplane_, "echo");
  const auto tool = tap({"--json", "--count", "6"}, 0);

  for (int i = 0; i < 3; ++i) {
    SyncClient client(backplane_, "echo");
    callMany(client, i, i + 1);
    while (tool->lineWith("\"reply\"").empty()) continue;
  }

  const auto ended = tool->end();
  EXPECT_THAT(ended.err, EndsWith("mpf tap: 6 messages seen, 0 missed\n"));
}

TEST_F(TapTest, FollowsItsServerThroughRestarts) {
  auto echo = std::make_unique<EchoThread>(backplane_, "echo");
  SyncClient client(backplane_, "echo");
  callMany(client, 0, 1);
  const auto tool = tap({"--json"});
  const auto nextReply = [&] {
    return messages({nlohmann::json::parse(tool->lineWith("\"reply\""))}, "reply")
        .at(0)
        .at("value");
  };
  callMany(client, 1, 2);
  EXPECT_EQ(nextReply(), 1);

  echo.reset();
  echo = std::make_unique<EchoThread>(backplane_, "echo");
  // The client may be notified late that the server has ended.
  while (!client.call(Int32Message({.value = 2}), 1h)) continue;

  EXPECT_EQ(nextReply(), 2);
}

TEST_F(TapTest, FollowsAThousandLinks) {
  Victim server("serve", backplane_.name());
  Victim crowd("crowd", backplane_.name(), {"1000"});
  while (!crowd.line().starts_with("answered ")) continue;
  const auto tool = tap({"--write", file_, "--count", "2"}, 1000);
  SyncClient client(backplane_, "echo");

  ASSERT_TRUE(client.call(Float64Message({.value = 5}), 1h));

  EXPECT_THAT(tool->end().err, EndsWith("mpf tap: 2 messages seen, 0 missed\n"));
  EXPECT_THAT(run({"replay", file_, "--speed", "0"}).out,
              HasSubstr("1 request of 1 client to \"echo\": 1 replied"));
  crowd.end(SIGKILL);
  server.end(SIGTERM);
}

TEST_F(TapTest, FollowsOneChosenLink) {
  const EchoThread echo(backplane_, "echo");
  SyncClient first(backplane_, "echo");
  callMany(first, 0, 1);
  const auto all = tap({"--json"});
  const auto link = nlohmann::json::parse(all->line()).at("link").get<std::string>();
  SyncClient second(backplane_, "echo");
  callMany(second, 0, 1);
  const auto tool = tap({"--json", "--count", "2", "--link", link});

  callMany(second, 10, 12);
  callMany(first, 20, 21);

  EXPECT_EQ(messages(objects(tool->end().out), "request").at(0).at("value"), 20);
  for (const auto* const word : {"x1", "9343"}) {
    const auto wrong = run({"tap", "echo", "--link", word});
    EXPECT_EQ(wrong.status, 2);
    EXPECT_THAT(wrong.err, HasSubstr(std::string("\"") + word +
                                     "\" is not a link: use the 16 hexadecimal digits"));
  }
}

TEST_F(TapTest, ReplaySendsARecordingInOrder) {
  {
    const EchoThread echo(backplane_, "echo");
    SyncClient one(backplane_, "echo");
    SyncClient two(backplane_, "echo");
    callMany(one, 0, 1);
    callMany(two, 0, 1);
    const auto tool = tap({"--write", file_, "--count", "44"}, 2);
    for (int i = 0; i < 10; ++i) {
      callMany(one, i, i + 1);
      callMany(two, 100 + i, 101 + i);
    }
    auto array = Int32ArrayMessage::allocValue(1000);
    std::ranges::fill(array.value(), 7);
    ASSERT_TRUE(one.call(std::move(array), 1h));
    ASSERT_TRUE(two.call(Char8ArrayMessage::allocValue(0), 1h));
    EXPECT_EQ(tool->end().status, 0);
  }
  std::vector<std::int32_t> values;
  std::size_t elements = 0;
  MessageServer server(backplane_, "echo");
  server.on<Int32>([&](Int32& request) { values.push_back(request.value); });
  server.on<Int32Array>([&](Int32ArrayMessage& request) { elements += request.value().size(); });
  server.on<Char8Array>([](Char8ArrayMessage&) {});
  std::thread thread([&] { server.run(); });

  const auto ended = run({"replay", file_, "--timeout", "1000", "--json"});

  server.interrupt();
  thread.join();
  EXPECT_EQ(ended.status, 0) << ended.err;
  const auto report = nlohmann::json::parse(ended.out);
  EXPECT_EQ(report.at("clients"), 2);
  EXPECT_EQ(report.at("requests"), 22);
  EXPECT_EQ(report.at("replied"), 22);
  EXPECT_THAT(report.at("ends"), IsEmpty());
  std::vector<std::int32_t> ofOne;
  std::ranges::copy_if(values, std::back_inserter(ofOne), [](auto value) { return value < 100; });
  EXPECT_THAT(ofOne, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9));
  EXPECT_EQ(values.size(), 20u);
  EXPECT_EQ(elements, 1000u);
}

TEST_F(TapTest, ReplayRefusesAFileThatIsNotARecording) {
  std::ofstream(file_) << "a text that is not a recording, but long enough for frame headers: ";

  const auto ended = run({"replay", file_});

  EXPECT_EQ(ended.status, 1);
  EXPECT_EQ(ended.err, "mpf replay: " + file_ +
                           ": record 1, at byte 0 of 67: not a recording of `mpf tap "
                           "--write`, or one that was cut off within its "
                           "first record\n");
  EXPECT_EQ(ended.out, "") << "no request was sent";
  EXPECT_EQ(run({"replay", file_ + ".none"}).status, 2);
}

TEST_F(TapTest, ReplaySendsATruncatedRecordingUpToItsEnd) {
  {
    const EchoThread echo(backplane_, "echo");
    SyncClient client(backplane_, "echo");
    callMany(client, 0, 1);
    const auto tool = tap({"--write", file_, "--count", "4"});
    callMany(client, 0, 2);
    EXPECT_EQ(tool->end().status, 0);
  }
  std::filesystem::resize_file(file_, std::filesystem::file_size(file_) - 5);
  const EchoThread echo(backplane_, "echo");

  const auto ended = run({"replay", file_, "--speed", "0", "--timeout", "1000"});

  EXPECT_EQ(ended.status, 1);
  EXPECT_THAT(ended.out, HasSubstr("2 requests of 1 client to \"echo\": 2 replied"));
  EXPECT_THAT(ended.err,
              testing::MatchesRegex("mpf replay: .*: record 5, at byte [0-9]+ of [0-9]+: the file "
                                    "is damaged, or was cut off here; the "
                                    "records before it can be read: `head -c [0-9]+ FILE >NEW` "
                                    "keeps them, `mpf tap --write` records "
                                    "again\n"));
}

TEST_F(TapTest, FailsAtOnceWhenTheFileCannotBeWritten) {
  const auto full = run({"tap", "nobody", "--write", "/dev/full"});
  const auto nowhere = run({"tap", "nobody", "--write", file_ + ".none/x"});

  EXPECT_EQ(full.status, 1);
  EXPECT_EQ(full.err, "mpf: write /dev/full: No space left on device\n");
  EXPECT_EQ(nowhere.status, 1);
  EXPECT_EQ(nowhere.err, "mpf: open " + file_ + ".none/x: No such file or directory\n");
}

TEST_F(TapTest, NamesAnAbsentServer) {
  const auto ended = run({"tap", "echo", "0.01"});
  EXPECT_EQ(ended.status, 0);
  EXPECT_EQ(ended.err,
            "mpf tap: server \"echo\" at location 0 is absent; waiting for it\nmpf tap: 0 "
            "messages seen, 0 missed\n");
}

}  // namespace
}  // namespace mpf::test
