// SPDX-License-Identifier: MIT
// Line: asks for signs of life, gives them, and ends when they are missing.
#include "tests/router/transport/line_fixture.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;
using testing::StartsWith;

TEST_F(LineTest, EndsWithoutAGreeting) {
  limits_.deadTime = 100ms;
  start();
  receive();

  EXPECT_THAT(farewell(), HasSubstr("code = silence"));
  EXPECT_THAT(end_, StartsWith("received nothing from the peer for "));
}

// Empty frames are signs of life, but they do not replace the greeting.
TEST_F(LineTest, EndsWhenOnlyEmptyFramesArrive) {
  pipe_ = io_.provider->newTwoWayPipe();  // of the kernel, which has a buffer
  peer_ = kj::mv(pipe_.ends[1]);
  limits_.handshakeTime = 100ms;
  start();

  while (end_.empty()) {
    send(frameOf({}));
    io_.provider->getTimer().afterDelay(kj::MILLISECONDS).wait(io_.waitScope);
  }

  EXPECT_EQ(end_, "the peer sent no greeting within 100 ms (handshake-time)");
}

TEST_F(LineTest, EndsWhenThePeerNeitherSendsNorReads) {
  limits_.deadTime = 100ms;
  startGreeted();

  waitForEnd();

  EXPECT_THAT(end_, StartsWith("received nothing from the peer for"));
}

TEST_F(LineTest, PingsAndContinuesWhileThePeerAnswers) {
  limits_.deadTime = 400ms;
  startGreeted();

  for (int i = 0; i < 12; ++i) {
    EXPECT_THAT(receive(), ElementsAre(HasSubstr("ping = ")));
    send(frameOf({[](wire::Item::Builder) {}}));
  }

  EXPECT_EQ(end_, "");
}

TEST_F(LineTest, ReadsDataThatArrivedWhileItDidNotRun) {
  pipe_ = io_.provider->newTwoWayPipe();  // of the kernel, which has a buffer
  peer_ = kj::mv(pipe_.ends[1]);
  limits_.deadTime = 100ms;
  startGreeted();

  beginToSend(frameOf({ping(1)}));
  for (const auto until = Clock::nowNs() + 300'000'000; Clock::nowNs() < until;) {
  }

  for (auto items = receive(); items.back() != "(pong = (stamp = 1))"; items = receive())
    ASSERT_THAT(items.back(), HasSubstr("ping"));
}

// A host was suspended with both ends of a line, so that at first neither end has anything to read.
TEST_F(LineTest, DoesNotCountTheTimeWhenItDidNotRun) {
  limits_.deadTime = 400ms;
  startGreeted();

  for (const auto until = Clock::nowNs() + 1'000'000'000; Clock::nowNs() < until;) {
  }

  for (int i = 0; i < 2; ++i) EXPECT_THAT(receive(), ElementsAre(HasSubstr("ping = ")));
  EXPECT_EQ(end_, "");
}

// A long message may take longer than the dead time on a slow network.
TEST_F(LineTest, ContinuesWhileALongFrameArrives) {
  limits_.deadTime = 400ms;
  startGreeted();
  const auto bytes = frameOf({[](wire::Item::Builder item) {
    item.initReply().initMessage().initUser().initValue(2u << 20);
  }});
  constexpr std::size_t kPart = std::size_t{64} << 10;

  for (std::size_t at = 0; at < bytes.size(); at += kPart) {
    EXPECT_THAT(receive(), ElementsAre(HasSubstr("ping = ")));
    send({bytes.begin() + static_cast<std::ptrdiff_t>(at),
          bytes.begin() + static_cast<std::ptrdiff_t>(std::min(at + kPart, bytes.size()))});
  }

  EXPECT_THAT(said_, SizeIs(1));
  EXPECT_EQ(end_, "");
}

// The line does not read meanwhile, because the peer does not read the answers to its pings either.
TEST_F(LineTest, ContinuesWhileThePeerReadsALongFrame) {
  constexpr auto kPart = router::SendQueue::kPartBytes;
  constexpr std::size_t kParts = 32;
  limits_.deadTime = 400ms;
  startGreeted();
  line_->send(
      Carried{.isRequest = true,
              .client = 1,
              .requestId = 1,
              .message = Char8ArrayMessage::inBuffer(
                  allocateHeapBody(Char8ArrayMessage::bytesFor(kParts * kPart)), kParts * kPart)});
  settle();
  beginToSend(frameOf(std::vector<Fill>(2 * router::SendQueue::kMaxControlItems, ping(1))));

  for (std::size_t part = 0; part < kParts && end_.empty(); ++part) {
    Bytes bytes(kPart);
    peer_->read(bytes.data(), bytes.size()).wait(io_.waitScope);
    io_.provider->getTimer().afterDelay(60 * kj::MILLISECONDS).wait(io_.waitScope);
  }

  EXPECT_EQ(end_, "");
}

TEST_F(LineTest, EndsWhenAFrameArrivesTooSlowly) {
  limits_.deadTime = 200ms;
  startGreeted();
  const auto bytes = frameOf({ping(1)});

  for (std::size_t at = 0; at + 1 < bytes.size() && end_.empty(); ++at) {
    receive();  // a ping, or the farewell
    if (end_.empty()) send({bytes[at]});
  }

  EXPECT_THAT(end_, StartsWith("received nothing from the peer for"));
}

TEST_F(LineTest, AnswersEachPing) {
  startGreeted();

  beginToSend(frameOf({ping(7), ping(8)}));

  EXPECT_THAT(receive(), ElementsAre("(pong = (stamp = 7))", "(pong = (stamp = 8))"));
}

// Counts the pings of the line during a second in which the peer sends pings. Repeats this when the
// test itself was delayed, so that a ping of the peer was late.
TEST_F(LineTest, SendsNoPingsWhileThePeerSendsThem) {
  constexpr auto kHalf = 200ms;
  limits_.deadTime = 2 * kHalf;
  int pings = 0;
  for (bool inTime = false; !inTime;) {
    restart();
    auto last = Clock::nowNs();
    startGreeted();
    pings = 0;
    inTime = true;
    for (const auto end = Deadline::after(5 * kHalf); !end.hasPassed();) {
      beginToSend(frameOf({ping(1)}));
      for (const auto& item : receive()) pings += item.starts_with("(ping = ") ? 1 : 0;
      inTime = inTime && Clock::nowNs() - last < Nanoseconds(kHalf).count();
      last = Clock::nowNs();
      io_.provider->getTimer().afterDelay(20 * kj::MILLISECONDS).wait(io_.waitScope);
    }
  }
  EXPECT_EQ(pings, 0);
}

}  // namespace
}  // namespace mpf::test
