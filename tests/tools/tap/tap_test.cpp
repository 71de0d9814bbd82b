// SPDX-License-Identifier: MIT
// `mpf tap`: shows and records messages.
#include <algorithm>
#include <cctype>
#include <regex>

#include "tests/support/victim.h"
#include "tests/tools/tap/tap_fixture.h"

namespace mpf::test {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::MatchesRegex;

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
      MatchesRegex(begin + "--   tools_test\\[[0-9]+\\] and echo: link [0-9a-f]+\n" +  //
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

// The numbers of seen and missed messages add up to all messages. The tap is stopped meanwhile:
// otherwise it misses nothing on a busy host, where each call is slow.
TEST_F(TapTest, CountsMissedMessages) {
  const EchoThread echo(backplane_, "echo");
  SyncClient client(backplane_, "echo");
  callMany(client, 0, 1);
  const auto tool = tap({"--poll", "0.1", "--json"});

  tool->signal(SIGSTOP);
  callMany(client, 0, 5'000);
  tool->signal(SIGINT);
  tool->signal(SIGCONT);

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
    EXPECT_THAT(wrong.err,
                testing::StartsWith(std::string("mpf tap: \"") + word +
                                    "\" is not a link: use its hexadecimal number, or at least its "
                                    "first 6 digits"));
  }
  // As inspect prints a number below 2^60.
  EXPECT_EQ(run({"tap", "echo", "0.1", "--link", "123456789abcdef"}).status, 0);
  auto upper = link;
  std::ranges::transform(upper, upper.begin(), [](unsigned char c) { return std::toupper(c); });
  EXPECT_THAT(run({"tap", "echo", "0.1", "--link", upper}).err, HasSubstr("has 1 link now"));
}

TEST_F(TapTest, FailsAtOnceWhenTheFileCannotBeWritten) {
  const auto full = run({"tap", "nobody", "--write", "/dev/full"});
  const auto nowhere = run({"tap", "nobody", "--write", file_ + ".none/x"});

  EXPECT_EQ(full.status, 1);
  EXPECT_EQ(full.err, "mpf tap: write /dev/full: No space left on device\n");
  EXPECT_EQ(nowhere.status, 1);
  EXPECT_EQ(nowhere.err, "mpf tap: open " + file_ + ".none/x: No such file or directory\n");
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
