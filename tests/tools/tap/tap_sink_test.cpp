// SPDX-License-Identifier: MIT
// TapSink: the lines, the JSON and the recording of hand-made messages.
#include "tools/tap/tap_sink.h"

#include <algorithm>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <system_error>

#include <mpf/message_of.h>

#include "schema/conversion.h"
#include "tests/support/temporary_folder.h"
#include "tools/tap/recording.h"

namespace mpf::tools {
namespace {

using nlohmann::json;

constexpr std::int64_t kAtNs = 3'723'000'456'789;  // 01:02:03.000456 on the first day of 1970

class TapSinkTest : public testing::Test {
 protected:
  void SetUp() override {
    ::setenv("TZ", "UTC", 1);
    ::tzset();
  }
  // What `act` writes to stdout.
  static std::string outputOf(const std::function<void()>& act) {
    testing::internal::CaptureStdout();
    act();
    return testing::internal::GetCapturedStdout();
  }
  static TappedMessage message(Direction direction, bool isFirstReply = false) {
    TappedMessage tapped;
    tapped.direction = direction;
    tapped.requestId = 17;
    tapped.isFirstReply = isFirstReply;
    tapped.message = Int32Message({.address = 3, .value = 5});
    return tapped;
  }
  static TappedMessage unreadable() {
    TappedMessage tapped;
    tapped.direction = Direction::reply;
    tapped.requestId = 17;
    tapped.problem = "the pool \x1b is gone";
    return tapped;
  }

  TappedLink link_{.incarnation = 0x71fa000000000001,
                   .server = "dac\n",
                   .location = 2,
                   .client = "mpf\x1b[2J",
                   .clientPid = 99};
};

TEST_F(TapSinkTest, LinesShowTheDirectionAndTheText) {
  const auto sink = TapSink::lines(16);
  const std::string begin = "01:02:03.000456  71fa  ";
  const std::string text = "17  int32 timeout=0 cmd=0 status=0 address=3 extra=0 value=5";

  EXPECT_EQ(outputOf([&] { sink->message(kAtNs, link_, message(Direction::request)); }),
            begin + "-> " + text + "\n");
  EXPECT_EQ(outputOf([&] { sink->message(kAtNs, link_, message(Direction::reply, true)); }),
            begin + "<- " + text + "\n");
  EXPECT_EQ(outputOf([&] { sink->message(kAtNs, link_, message(Direction::reply)); }),
            begin + "<  " + text + "\n")
      << "the request has been answered before";
  auto late = message(Direction::request);
  late.mayHaveChanged = true;
  EXPECT_EQ(outputOf([&] { sink->message(kAtNs, link_, late); }),
            begin + "-> " + text + "  (read late: may have changed)\n");
}

// The names and problems come from other processes.
TEST_F(TapSinkTest, LinesEscapeControlCharacters) {
  const auto sink = TapSink::lines(16);
  const std::string begin = "01:02:03.000456  71fa  ";

  EXPECT_EQ(outputOf([&] { sink->opened(kAtNs, link_); }),
            begin + "--   mpf\\x1b[2J[99] and dac\\n: link 71fa000000000001\n");
  EXPECT_EQ(outputOf([&] { sink->message(kAtNs, link_, unreadable()); }),
            begin + "<  17  unreadable: the pool \\x1b is gone\n");
}

TEST_F(TapSinkTest, LinesReportMissedMessagesAndTheEndOfALink) {
  const auto sink = TapSink::lines(16);
  link_.client.clear();

  EXPECT_EQ(outputOf([&] {
              sink->opened(kAtNs, link_);
              sink->missed(kAtNs, link_, 1);
              sink->missed(kAtNs, link_, 7);
              sink->closed(kAtNs, link_);
            }),
            "01:02:03.000456  71fa  --   a client that has ended and dac\\n: link "
            "71fa000000000001\n"
            "01:02:03.000456  71fa  --   1 message missed so far: they arrived too fast\n"
            "01:02:03.000456  71fa  --   7 messages missed so far: they arrived too fast\n"
            "01:02:03.000456  71fa  --   closed\n");
}

TEST_F(TapSinkTest, LinesShowTheFirstElementsOfAnArray) {
  const auto sink = TapSink::lines(2);
  TappedMessage array;
  auto values = Int32ArrayMessage::allocValue(3);
  std::ranges::fill(values.value(), 4);
  array.message = std::move(values);

  const auto text = outputOf([&] { sink->message(kAtNs, link_, array); });

  EXPECT_THAT(text, testing::EndsWith("value=4,4,... (3)\n"));
}

TEST_F(TapSinkTest, JsonIsOneObjectInEachLine) {
  const auto sink = TapSink::json();
  const auto objectOf = [&](const std::function<void()>& act) {
    const auto text = outputOf(act);
    EXPECT_EQ(std::ranges::count(text, '\n'), 1) << text;
    auto object = json::parse(text);
    EXPECT_EQ(object.at("at_ns"), kAtNs);
    EXPECT_EQ(object.at("link"), "71fa000000000001");
    return object;
  };

  EXPECT_EQ(objectOf([&] { sink->opened(kAtNs, link_); }).at("opened"),
            (json{{"server", "dac\n"}, {"location", 2}, {"client", "mpf\x1b[2J"}, {"pid", 99}}));
  const auto reply =
      objectOf([&] { sink->message(kAtNs, link_, message(Direction::reply, true)); });
  EXPECT_EQ(reply.at("direction"), "reply");
  EXPECT_EQ(reply.at("requestId"), 17);
  EXPECT_EQ(reply.at("firstReply"), true);
  EXPECT_EQ(reply.at("mayHaveChanged"), false);
  EXPECT_EQ(reply.at("message").at("value"), 5);
  const auto problem = objectOf([&] { sink->message(kAtNs, link_, unreadable()); });
  EXPECT_EQ(problem.at("problem"), "the pool \x1b is gone");
  EXPECT_FALSE(problem.contains("message"));
  EXPECT_EQ(objectOf([&] { sink->missed(kAtNs, link_, 7); }).at("missed"), 7);
  EXPECT_EQ(objectOf([&] { sink->closed(kAtNs, link_); }).at("closed"), true);
}

TEST_F(TapSinkTest, AFileHasARecordForEachCall) {
  const test::TemporaryFolder folder;
  const auto path = folder.file("x.mpf");
  const auto sink = TapSink::file(path);
  auto request = message(Direction::request);
  request.mayHaveChanged = true;
  sink->opened(kAtNs, link_);
  sink->message(kAtNs, link_, request);
  sink->message(kAtNs, link_, unreadable());
  sink->missed(kAtNs, link_, 7);
  sink->closed(kAtNs, link_);
  sink->finish();

  RecordingReader reader(path);
  const auto next = [&](const std::function<void(wire::Record::Reader)>& check) {
    EXPECT_TRUE(reader.tryNext([&](wire::Record::Reader record) {
      EXPECT_EQ(record.getAtNs(), kAtNs);
      EXPECT_EQ(record.getLink(), link_.incarnation);
      check(record);
    }));
  };

  next([&](wire::Record::Reader record) {
    ASSERT_TRUE(record.isOpened());
    EXPECT_EQ(record.getOpened().getServer(), "dac\n");
    EXPECT_EQ(record.getOpened().getLocation(), 2);
    EXPECT_EQ(record.getOpened().getClient(), "mpf\x1b[2J");
    EXPECT_EQ(record.getOpened().getClientPid(), 99);
  });
  next([](wire::Record::Reader record) {
    ASSERT_TRUE(record.isMessage());
    const auto recorded = record.getMessage();
    EXPECT_EQ(recorded.getDirection(), wire::Direction::REQUEST);
    EXPECT_EQ(recorded.getRequestId(), 17U);
    EXPECT_FALSE(recorded.getIsFirstReply());
    EXPECT_TRUE(recorded.getMayHaveChanged());
    ConversionError error;
    const auto back = tryFromWire(recorded.getEnvelope(), {}, error);
    ASSERT_TRUE(back) << error.text;
    EXPECT_EQ(back->tryAs<Int32>()->value, 5);
  });
  next([](wire::Record::Reader record) {
    ASSERT_TRUE(record.isUnreadable());
    EXPECT_EQ(record.getUnreadable().getDirection(), wire::Direction::REPLY);
    EXPECT_EQ(record.getUnreadable().getRequestId(), 17U);
    EXPECT_EQ(record.getUnreadable().getProblem(), "the pool \x1b is gone");
  });
  next([](wire::Record::Reader record) { EXPECT_EQ(record.getMissed(), 7U); });
  next([](wire::Record::Reader record) { EXPECT_TRUE(record.isClosed()); });
  EXPECT_FALSE(reader.tryNext([](wire::Record::Reader) {}));
}

// A body that does not fit its type cannot be sent again: the reason is recorded instead.
TEST_F(TapSinkTest, AFileHasTheReasonWhyAMessageCannotBeConverted) {
  const test::TemporaryFolder folder;
  const auto path = folder.file("x.mpf");
  const auto sink = TapSink::file(path);
  auto unsound = message(Direction::request);
  unsound.message = Message::copyOf(MessageType::int32, std::vector(2, std::byte{1}));
  sink->message(kAtNs, link_, unsound);
  sink->finish();

  RecordingReader reader(path);

  EXPECT_TRUE(reader.tryNext([](wire::Record::Reader record) {
    ASSERT_TRUE(record.isUnreadable());
    EXPECT_THAT(record.getUnreadable().getProblem().cStr(), testing::HasSubstr("int32"));
  }));
}

TEST_F(TapSinkTest, AFileThatCannotBeWrittenIsAnError) {
  EXPECT_THROW(static_cast<void>(TapSink::file("/dev/full")), std::system_error);
}

}  // namespace
}  // namespace mpf::tools
