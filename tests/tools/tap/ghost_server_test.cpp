// SPDX-License-Identifier: MIT
// GhostServer: replies, refusals and silences at the times of a recording.
#include "tools/tap/ghost_server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <optional>
#include <thread>

#include <mpf/message_client.h>

#include "tests/support/temporary_folder.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"
#include "tests/tools/tap/made_recording.h"

namespace mpf::tools {
namespace {

using std::chrono_literals::operator""ms;

class GhostServerTest : public testing::Test {
 protected:
  ~GhostServerTest() override {
    if (ghost_) ghost_->stop();
    if (thread_.joinable()) thread_.join();
  }
  void start(double speed) {
    script_.emplace(file_);
    ghost_.emplace(backplane_, "dac", ServerOptions{}, *script_, speed);
    thread_ = std::thread([this] { ghost_->run(); });
    client_.bind("dac");
    while (!client_.isConnected()) step();
  }
  void step() { dispatcher_.runOnce(Deadline::after(1ms)); }
  void send(std::int32_t cmd, std::int32_t mark = 0) {
    Int32Message request({.cmd = cmd});
    request.setClientType(mark);
    ASSERT_EQ(client_.send(std::move(request)), SendResult::sent);
  }
  Message next() {
    while (messages_.empty()) step();
    auto message = std::move(messages_.front());
    messages_.erase(messages_.begin());
    return message;
  }
  static Int32Message value(std::int32_t value) { return Int32Message({.value = value}); }
  static Int32Message command(std::int32_t cmd) { return Int32Message({.cmd = cmd}); }
  static std::int32_t valueOf(const Message& message) { return message.tryAs<Int32>()->value; }

  const mpf::test::Watchdog watchdog_{"ghost server"};
  const mpf::test::TestBackplane backplane_;
  const mpf::test::TemporaryFolder files_;
  const std::string file_ = files_.file("made.mpf");
  mpf::test::MadeRecording recording_{file_};
  std::optional<GhostScript> script_;
  std::optional<GhostServer> ghost_;
  std::thread thread_;
  std::vector<Message> messages_;
  Dispatcher dispatcher_{backplane_};
  MessageClient client_{dispatcher_, [this](Message&& message) {
                          if (message.getType() != MessageType::connect)
                            messages_.push_back(std::move(message));
                        }};
};

TEST_F(GhostServerTest, RepliesNotBeforeTheRecordedTime) {
  recording_.open(1, "dac");
  recording_.request(1, 1, 0ms, command(1));
  recording_.reply(1, 1, 60ms, value(1));
  recording_.reply(1, 1, 90ms, value(2));
  start(1);

  const auto begin = Clock::nowNs();
  send(1, 11);

  EXPECT_EQ(valueOf(next()), 1);
  EXPECT_GE(Clock::nowNs() - begin, Nanoseconds(60ms).count());
  const auto last = next();
  EXPECT_EQ(valueOf(last), 2);
  EXPECT_EQ(last.getClientType(), 11);
  EXPECT_GE(Clock::nowNs() - begin, Nanoseconds(90ms).count());
}

TEST_F(GhostServerTest, RepliesToALaterRequestFirstIfItsReplyIsDueEarlier) {
  recording_.open(1, "dac");
  recording_.request(1, 1, 0ms, command(1));
  recording_.reply(1, 1, std::chrono::hours(1), value(1));
  recording_.request(1, 2, 0ms, command(2));
  recording_.reply(1, 2, 20ms, value(2));
  start(1);

  send(1, 11);
  send(2, 22);

  const auto first = next();
  EXPECT_EQ(valueOf(first), 2);
  EXPECT_EQ(first.getClientType(), 22);
}

TEST_F(GhostServerTest, HasNoDelaysAtSpeedZero) {
  recording_.open(1, "dac");
  recording_.request(1, 1, 0ms, command(1));
  recording_.reply(1, 1, std::chrono::hours(1), value(1));
  recording_.reply(1, 1, std::chrono::hours(2), value(2));
  start(0);

  send(1);

  EXPECT_EQ(valueOf(next()), 1);
  EXPECT_EQ(valueOf(next()), 2);
}

TEST_F(GhostServerTest, IsSlowAtAnySpeedAboveZero) {
  recording_.open(1, "dac");
  recording_.request(1, 1, 0ms, command(1));
  recording_.reply(1, 1, std::chrono::hours(1), value(1));
  recording_.request(1, 2, 0ms, command(2));
  recording_.reply(1, 2, 0ms, value(2));
  start(1e-300);

  send(1);
  send(2);

  EXPECT_EQ(valueOf(next()), 2);
}

TEST_F(GhostServerTest, RefusesAndStaysSilentAsRecorded) {
  recording_.open(1, "dac");
  recording_.request(1, 1, 0ms, command(1));
  recording_.reply(1, 1, 1ms, RequestFateMessage({.fate = Fate::refused, .requestId = 1}));
  recording_.request(1, 2, 0ms, command(2));
  start(1);

  send(2);
  send(1);
  send(3);

  for (int i = 0; i < 2; ++i) {
    const auto ended = next();
    ASSERT_NE(ended.tryAs<RequestFate>(), nullptr);
    EXPECT_EQ(ended.tryAs<RequestFate>()->fate, Fate::refused);
  }
  ghost_->stop();
  thread_.join();
  EXPECT_EQ(ghost_->counts().requests, 3u);
  EXPECT_EQ(ghost_->counts().silent, 1u);
  EXPECT_EQ(ghost_->counts().unknown, 1u);
  ghost_.reset();
  EXPECT_EQ(next().tryAs<RequestFate>()->fate, Fate::outcomeUnknown);
}

// A subscription of a client that does not receive: the replies wait.
TEST_F(GhostServerTest, KeepsRepliesThatFindTheQueueFull) {
  constexpr int kReplies = 1000;
  recording_.open(1, "dac");
  recording_.request(1, 1, 0ms, command(1));
  for (int i = 0; i < kReplies; ++i) recording_.reply(1, 1, 0ms, value(i));
  start(0);

  send(1);

  for (int i = 0; i < kReplies; ++i) ASSERT_EQ(valueOf(next()), i);
}

TEST_F(GhostServerTest, ShiftsTimeStampsToTheTimeOfTheReply) {
  recording_.open(1, "dac");
  recording_.request(1, 1, 0ms, command(1));
  auto stamped = value(1);
  stamped.setTimeStampNs(test::MadeRecording::kBeginNs + Nanoseconds(3ms).count());
  recording_.reply(1, 1, 5ms, stamped);
  start(0);

  const auto before = Clock::wallNs();
  send(1);

  const auto age = Nanoseconds(2ms).count();
  const auto stamp = next().getTimeStampNs();
  EXPECT_GE(stamp, before - age);
  EXPECT_LE(stamp, Clock::wallNs() - age);
}

}  // namespace
}  // namespace mpf::tools
