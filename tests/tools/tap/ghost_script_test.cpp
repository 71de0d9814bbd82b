// SPDX-License-Identifier: MIT
// GhostScript: which recorded replies belong to a request.
#include "tools/tap/ghost_script.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"
#include "tests/tools/tap/made_recording.h"

namespace mpf::tools {
namespace {

using std::chrono_literals::operator""ms;
using Match = GhostScript::Match;

class GhostScriptTest : public testing::Test {
 protected:
  static Int32Message command(std::int32_t cmd, std::int32_t value = 0) {
    return Int32Message({.cmd = cmd, .value = value});
  }
  // The value of the first reply; -1 without a reply.
  static std::int32_t valueOf(const GhostScript::Found& found) {
    if (found.exchange == nullptr || found.exchange->replies.empty()) return -1;
    return found.exchange->replies.front().message.tryAs<Int32>()->value;
  }

  const mpf::test::TemporaryFolder files_;
  const std::string file_ = files_.file("made.mpf");
  mpf::test::MadeRecording recording_{file_};
};

TEST_F(GhostScriptTest, HasTheRepliesOfARequestWithTheirDelays) {
  recording_.open(1, "dac");
  recording_.request(1, 7, 10ms, command(1));
  recording_.request(1, 8, 11ms, command(2));
  recording_.reply(1, 8, 12ms, command(2, 5));
  recording_.reply(1, 7, 30ms, command(1, 6));
  recording_.reply(1, 8, 50ms, command(2, 7));

  GhostScript script(file_);

  EXPECT_EQ(script.server(), "dac");
  EXPECT_EQ(script.requests(), 2u);
  const auto first = script.next(command(1));
  EXPECT_EQ(first.match, Match::same);
  ASSERT_EQ(first.exchange->replies.size(), 1u);
  EXPECT_EQ(first.exchange->replies[0].after, 20ms);
  const auto second = script.next(command(2));
  ASSERT_EQ(second.exchange->replies.size(), 2u);
  EXPECT_EQ(second.exchange->replies[0].after, 1ms);
  EXPECT_EQ(second.exchange->replies[1].after, 39ms);
}

TEST_F(GhostScriptTest, UsesTheRepliesToEqualRequestsInTurn) {
  recording_.open(1, "dac");
  recording_.open(2, "dac");
  for (std::uint32_t id = 1; id <= 3; ++id) {
    const std::uint64_t link = id % 2 + 1;
    recording_.request(link, id, 0ms, command(1));
    recording_.reply(link, id, 0ms, command(1, static_cast<std::int32_t>(id)));
  }
  GhostScript script(file_);

  for (const auto expected : {1, 2, 3, 1, 2}) EXPECT_EQ(valueOf(script.next(command(1))), expected);
}

TEST_F(GhostScriptTest, ARequestWithAnotherValueIsSimilar) {
  recording_.open(1, "dac");
  recording_.request(1, 1, 0ms, Int32Message({.timeout = 1, .cmd = 1, .value = 5}));
  recording_.reply(1, 1, 0ms, command(1, 6));
  GhostScript script(file_);

  const auto other = script.next(command(1, 99));
  EXPECT_EQ(other.match, Match::similar);
  EXPECT_EQ(valueOf(other), 6);
  EXPECT_EQ(script.next(command(2)).match, Match::none);
  EXPECT_EQ(script.next(Float64Message({.cmd = 1})).match, Match::none);
}

TEST_F(GhostScriptTest, ComparesTheElementsOfArrays) {
  const auto text = [](std::string_view bytes) {
    auto message = Char8ArrayMessage::allocValue(bytes.size());
    std::ranges::copy(bytes, message.value().begin());
    return message;
  };
  recording_.open(1, "serial");
  recording_.request(1, 1, 0ms, text("ID?"));
  recording_.reply(1, 1, 0ms, command(0, 1));
  recording_.request(1, 2, 0ms, text("VOLT?"));
  recording_.reply(1, 2, 0ms, command(0, 2));
  GhostScript script(file_);

  EXPECT_EQ(valueOf(script.next(text("VOLT?"))), 2);
  EXPECT_EQ(valueOf(script.next(text("ID?"))), 1);
  EXPECT_EQ(script.next(text("CURR?")).match, Match::similar);
}

TEST_F(GhostScriptTest, KnowsUnansweredRequestsAndMissedMessages) {
  recording_.open(1, "dac");
  recording_.request(1, 1, 0ms, command(1));
  recording_.missed(1, 2);
  recording_.missed(1, 5);
  GhostScript script(file_);

  EXPECT_EQ(script.missed(), 5u) << "the total of the link";
  const auto found = script.next(command(1));
  EXPECT_EQ(found.match, Match::same);
  EXPECT_TRUE(found.exchange->replies.empty());
}

TEST_F(GhostScriptTest, IsOfTheFirstServer) {
  recording_.open(1, "dac");
  recording_.open(2, "adc");
  recording_.request(2, 1, 0ms, command(1));
  recording_.request(1, 1, 0ms, command(2));
  GhostScript script(file_);

  EXPECT_EQ(script.requests(), 1u);
  EXPECT_EQ(script.next(command(1)).match, Match::none);
}

TEST_F(GhostScriptTest, ARecordingWithoutRequestIsAnError) {
  recording_.open(1, "dac");
  EXPECT_THAT([&] { GhostScript{file_}; },
              testing::ThrowsMessage<std::runtime_error>(testing::HasSubstr("no request in it")));
}

}  // namespace
}  // namespace mpf::tools
