// SPDX-License-Identifier: MIT
// Line: its start and its end, and the messages that share a frame.
#include "tests/router/busy_tasks.h"
#include "tests/router/transport/line_fixture.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using testing::StartsWith;

// ---- the start

TEST_F(LineTest, SendsItsGreetingAtOnceInAFrameOfItsOwn) {
  start();

  EXPECT_THAT(receive(), ElementsAre(AllOf(HasSubstr("greeting = "), HasSubstr("protocolMajor = 1"),
                                           HasSubstr("maxFrameBytes = 68157440"))));
}

TEST_F(LineTest, ReportsThePeersGreetingAndLaterItems) {
  start();
  receive();

  send(frameOf({greeting(), [](wire::Item::Builder item) { item.setClose(7); }}));

  EXPECT_THAT(said_, ElementsAre("greeted", HasSubstr("close = 7")));
  EXPECT_EQ(line_->peer().router, "by hand");
}

class NoGreetingTest : public LineTest, public testing::WithParamInterface<Fill> {};

TEST_P(NoGreetingTest, EndsTheLine) {
  start();
  receive();

  send(frameOf({GetParam(), greeting()}));

  EXPECT_THAT(farewell(), AllOf(HasSubstr("code = protocol"), HasSubstr("is not a greeting")));
  EXPECT_THAT(end_, HasSubstr("is not a greeting"));
  EXPECT_THAT(said_, IsEmpty());
}
INSTANTIATE_TEST_SUITE_P(AsFirstItem, NoGreetingTest,
                         testing::Values(ping(1),
                                         Fill([](wire::Item::Builder item) { item.setClose(1); }),
                                         Fill([](wire::Item::Builder) {})));

TEST_F(LineTest, EndsWithAPeerOfAnotherMajorVersion) {
  start();
  receive();

  send(frameOf({greeting([](auto greeting) { greeting.setProtocolMajor(2); })}));

  EXPECT_THAT(farewell(), AllOf(HasSubstr("code = version"), HasSubstr("protocol 2.0")));
  EXPECT_THAT(end_, HasSubstr("this router 1.x"));
}

TEST_F(LineTest, AcceptsAnyMinorVersion) {
  startGreeted(greeting([](auto greeting) { greeting.setProtocolMinor(999); }));
}

TEST_F(LineTest, EndsWhenThePeerAcceptsOnlyShortFrames) {
  start();
  receive();

  send(frameOf({greeting([](auto greeting) { greeting.setMaxFrameBytes(65'535); })}));

  EXPECT_THAT(farewell(), AllOf(HasSubstr("code = protocol"), HasSubstr("65535")));
}

// The first bytes of a handshake, and the alert with which TLS answers a plain greeting.
TEST_F(LineTest, ReportsThatThePeerUsesTls) {
  for (const Bytes& bytes : {Bytes{0x16, 3, 1, 2, 0, 1}, Bytes{0x15, 3, 1, 0, 2, 2, 70}}) {
    start();
    receive();

    send(bytes);

    EXPECT_THAT(farewell(), AllOf(HasSubstr("code = protocol"), HasSubstr("the peer uses TLS")));
    restart();
  }
}

TEST_F(LineTest, ExplainsAPeerThatClosesBeforeItsGreeting) {
  start();
  receive();

  peer_ = nullptr;
  settle();

  EXPECT_THAT(end_,
              StartsWith("the peer closed the connection before its greeting: is it a router"));
}

// A peer gets no memory for long frames before its greeting.
TEST_F(LineTest, EndsAtALongGreeting) {
  start();
  receive();

  beginToSend(
      frameOf({greeting([](auto greeting) { greeting.setRouter(std::string(65'536, 'x')); })}));

  EXPECT_THAT(farewell(), HasSubstr("code = limit"));
}

TEST_F(LineTest, EscapesAndShortensTextsOfThePeer) {
  startGreeted(
      greeting([](auto greeting) { greeting.setRouter("evil\n\x1b[2J" + std::string(300, 'x')); }));

  EXPECT_THAT(line_->peer().router, AllOf(StartsWith(R"(evil\n\x1b[2Jxxx)"), SizeIs(200)));
}

// ---- the end

TEST_F(LineTest, EndsWhenThePeerCloses) {
  startGreeted();

  peer_ = nullptr;
  settle();

  EXPECT_EQ(end_, "the peer closed the connection");
}

TEST_F(LineTest, EndsWithThePeersFarewell) {
  startGreeted();

  send(frameOf(
      {[](wire::Item::Builder item) { item.initFarewell().setReason("good night"); }, ping(1)}));

  EXPECT_EQ(end_, "the peer ended the connection: good night");
}

TEST_F(LineTest, SendsItsFarewellAfterWaitingItems) {
  startGreeted();
  line_->send(request(1));
  settle();
  line_->send(request(2));
  line_->end(FarewellCode::STOPPING, "enough");

  line_->send(request(3));

  EXPECT_THAT(receive(), ElementsAre(HasSubstr("requestId = 1")));
  EXPECT_THAT(receive(), ElementsAre(HasSubstr("requestId = 2"), HasSubstr("code = stopping")));
  EXPECT_EQ(end_, "")
      << "unread data of the peer would reset the connection before it reads the farewell";
  send(frameOf({ping(1)}));
  EXPECT_EQ(end_, "");
  close();
  EXPECT_EQ(end_, "enough");
  EXPECT_THAT(line_->takeUnsentRequests(), SizeIs(1));
}

TEST_F(LineTest, ReturnsRequestsThatWereNeverWritten) {
  startGreeted();
  line_->send(request(1));
  settle();  // it is being written, and may arrive
  line_->send(request(2));
  line_->send(request(3));

  peer_ = nullptr;
  settle();

  const auto unsent = line_->takeUnsentRequests();
  ASSERT_THAT(unsent, SizeIs(2));
  EXPECT_EQ(unsent[0].requestId, 2u);
  EXPECT_EQ(unsent[1].requestId, 3u);
}

TEST_F(LineTest, EndsWithAFarewellAtAnInvalidFrame) {
  startGreeted();
  auto bytes = frameOf({ping(1)});
  bytes[8] = 0xfc;  // an invalid root pointer

  send(bytes);

  EXPECT_THAT(farewell(), HasSubstr("code = protocol"));
  EXPECT_THAT(end_, HasSubstr("a frame that cannot be read"));
}

TEST_F(LineTest, EndsWithTheCodeOfAProtocolErrorOfItsUser) {
  startGreeted();
  onItem_ = [](auto) { throw ProtocolError(FarewellCode::LIMIT, "too many"); };

  send(frameOf({[](wire::Item::Builder item) { item.setClose(1); }, ping(1)}));

  EXPECT_THAT(farewell(), AllOf(HasSubstr("code = limit"), HasSubstr("too many")));
}

// ---- messages that share a frame

TEST_F(LineTest, SendsAMessageAtOnceWhenItIsIdle) {
  startGreeted();

  for (std::uint32_t id = 1; id <= 3; ++id) {
    line_->send(request(id));
    EXPECT_THAT(receive(), ElementsAre(HasSubstr("requestId = " + std::to_string(id))));
  }
}

TEST_F(LineTest, MessagesQueuedDuringAWriteShareTheNextFrame) {
  startGreeted();
  line_->send(request(1));
  settle();

  for (std::uint32_t id = 2; id <= 100; ++id) {
    line_->send(request(id));
    settle();
  }

  EXPECT_THAT(receive(), ElementsAre(HasSubstr("requestId = 1")));
  const auto items = receive();
  ASSERT_THAT(items, SizeIs(99));
  for (std::uint32_t at = 0; at < 99; ++at)
    EXPECT_THAT(items[at], HasSubstr("requestId = " + std::to_string(at + 2) + ","));
}

// As while many other peers send all the time.
TEST_F(LineTest, WritesThoughOtherTasksAreAlwaysReady) {
  startGreeted();
  const BusyTasks busy(io_);

  line_->send(request(1));

  EXPECT_THAT(receiveWhileBusy(), ElementsAre(HasSubstr("requestId = 1")));
}

TEST_F(LineTest, AFrameIsLimitedToTheBufferSize) {
  limits_.bufferBytes = 4096;
  startGreeted();
  const auto sendArray = [&](std::uint32_t id, std::size_t bytes) {
    auto message =
        Char8ArrayMessage::inBuffer(allocateHeapBody(Char8ArrayMessage::bytesFor(bytes)), bytes);
    line_->send(
        Carried{.isRequest = true, .client = 1, .requestId = id, .message = std::move(message)});
  };

  for (std::uint32_t id = 1; id <= 6; ++id) sendArray(id, 1000);
  sendArray(7, 100'000);
  line_->send(request(8));

  EXPECT_THAT(receive(), SizeIs(3));
  EXPECT_THAT(receive(), SizeIs(3));
  EXPECT_THAT(receive(), SizeIs(1)) << "larger than the buffer size";
  EXPECT_THAT(receive(), ElementsAre(HasSubstr("requestId = 8")));
}

TEST_F(LineTest, HasNoRoomWhileItsQueueIsFull) {
  limits_.queueSize = 3;
  int rooms = 0;
  startGreeted();
  onRoom_ = [&] { ++rooms; };
  line_->send(request(1));
  settle();

  for (std::uint32_t id = 2; id <= 4; ++id) {
    EXPECT_TRUE(line_->hasRoom());
    line_->send(request(id));
  }
  EXPECT_FALSE(line_->hasRoom());
  receive();

  EXPECT_EQ(rooms, 1);
  EXPECT_TRUE(line_->hasRoom());
}

// ---- limits

TEST_F(LineTest, DoesNotSendAMessageThatIsTooLarge) {
  limits_.maxMessageBytes = 1000;
  startGreeted();
  auto message =
      Char8ArrayMessage::inBuffer(allocateHeapBody(Char8ArrayMessage::bytesFor(1001)), 1001);
  line_->send(
      Carried{.isRequest = true, .client = 1, .requestId = 1, .message = std::move(message)});
  line_->send(request(2));

  EXPECT_THAT(receive(), ElementsAre("(none = void)", HasSubstr("requestId = 2")));
  EXPECT_THAT(said_,
              ElementsAre(AllOf(HasSubstr("cannot send 1"), HasSubstr("the limit is 1000"))));
}

TEST_F(LineTest, SendsNoMessageThatExceedsThePeersFrames) {
  startGreeted(greeting([](auto greeting) { greeting.setMaxFrameBytes(65'536); }));

  EXPECT_LT(line_->maxMessageBytes(), 65'536u - 256);
}

// Otherwise the answers to its pings would gather here without a limit.
TEST_F(LineTest, StopsReadingFromAPeerThatDoesNotRead) {
  startGreeted();
  constexpr std::uint64_t kPings = 100'000;
  std::vector<Fill> pings;
  for (std::uint64_t stamp = 0; stamp < kPings; ++stamp) pings.push_back(ping(stamp));

  beginToSend(joined({frameOf(pings), Bytes(std::size_t{8} << 20)}));  // too large for any buffer
  settle();
  EXPECT_FALSE(sent_);

  for (std::uint64_t stamp = 0; stamp < kPings;) {
    for (const auto& item : receive()) {
      if (stamp == kPings) break;  // a farewell: the zeros are not a valid frame
      if (item.starts_with("(ping")) continue;  // the line has been silent for a while
      ASSERT_EQ(item, "(pong = (stamp = " + std::to_string(stamp++) + "))");
    }
  }
}

TEST_F(LineTest, LetsOtherTasksRunDuringALongFrame) {
  startGreeted();
  onItem_ = [until = std::int64_t{0}](auto) mutable {
    for (until = Clock::nowNs() + 100'000; Clock::nowNs() < until;) {
    }
  };
  beginToSend(frameOf(std::vector<Fill>(1000, [](wire::Item::Builder item) { item.setClose(1); })));

  int turns = 0;
  while (said_.size() < 1000) {
    io_.provider->getTimer().afterDelay(0 * kj::NANOSECONDS).wait(io_.waitScope);
    ++turns;
  }

  EXPECT_GE(turns, 10);
}

}  // namespace
}  // namespace mpf::test
