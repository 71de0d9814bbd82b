// SPDX-License-Identifier: MIT
// Every peer writes hints, so any peer can erase hints or write false ones: that costs time, never
// a message.
#include <poll.h>

#include <thread>

#include "shm/segment_name.h"
#include "tests/client/client_fixture.h"

namespace mpf::test {
namespace {

class LostHintTest : public ClientTest {
 protected:
  void SetUp() override {
    startServer({.location = 0, .waitMode = WaitMode::block}).on<Int32>([](Int32&) {});
    client_.bind("device[0]/a", 0);
  }
  // The hints of the only server or the only dispatcher, as a peer may write them.
  Segment hintsOf(layout::SegmentKind kind) {
    const auto* mark = kind == layout::SegmentKind::serverWindow ? ".s." : ".c.";
    for (const auto& name : backplane_.segmentNames()) {
      if (name.find(mark) == std::string::npos) continue;
      const auto incarnation = PeerWindow::tryOpen(name, kind)->header().incarnation;
      return *Segment::tryOpen(SegmentName::keyed(backplane_.name(), NameKind::hints, incarnation),
                               layout::SegmentKind::hints, Segment::Access::readWrite);
    }
    return {};
  }
  // Erases the hints that the owner has not read yet.
  static void lose(const Segment& segment) {
    auto& hints = segment.at<layout::WindowHints>(0);
    for (auto& knock : hints.knocks) knock.store(0);
    for (auto& word : hints.readyWords) word.store(0);
    for (auto& bits : hints.readyBits) bits.store(0);
  }
  // Waits until the client expects no more messages, and neither side polls the link.
  void settle() {
    runUntil([&] { return dispatcher_.nextDeadline().isNever(); });
    while (server_->waitForMessage(Deadline::after(1ms))) EXPECT_FALSE(server_->receive());
    while (dispatcher_.runOnce(Deadline::after(10ms))) {
    }
  }
};

TEST_F(LostHintTest, ALostKnockDelaysTheConnection) {
  lose(hintsOf(layout::SegmentKind::serverWindow));

  runUntil([&] { return client_.isConnected(); });
}

TEST_F(LostHintTest, AnAcceptanceWhoseHintIsLostIsFound) {
  const auto hints = hintsOf(layout::SegmentKind::clientWindow);
  EXPECT_FALSE(server_->receive());

  lose(hints);

  runUntil([&] { return client_.isConnected(); });
}

TEST_F(LostHintTest, ARequestWhoseHintIsLostGetsItsReply) {
  const auto hints = hintsOf(layout::SegmentKind::serverWindow);
  runUntil([&] { return client_.isConnected(); });
  for (int i = 0; i < 3; ++i) {
    settle();
    ASSERT_EQ(client_.send(Int32Message({.value = i})), SendResult::sent);

    lose(hints);

    EXPECT_EQ(next().tryAs<Int32>()->value, i);
  }
}

TEST_F(LostHintTest, AReplyWhoseHintIsLostIsDelivered) {
  const auto hints = hintsOf(layout::SegmentKind::clientWindow);
  runUntil([&] { return client_.isConnected(); });
  for (int i = 0; i < 3; ++i) {
    settle();
    ASSERT_EQ(client_.send(Int32Message({.value = i})), SendResult::sent);
    while (!server_->handleOne()) {
    }

    lose(hints);

    EXPECT_EQ(next().tryAs<Int32>()->value, i);
  }
}

// A process that may ring a doorbell may also consume its rings.
TEST_F(LostHintTest, ARingThatAnotherProcessConsumedIsRepeated) {
  runUntil([&] { return client_.isConnected(); });
  settle();
  const auto incarnation = hintsOf(layout::SegmentKind::serverWindow).header().ownerWindow;
  const auto fifo =
      doorbell::tryOpenFifo(SegmentName::keyed(backplane_.name(), NameKind::fifo, incarnation));
  ASSERT_TRUE(fifo);
  pollfd readable{server_->descriptor(), POLLIN, 0};
  EXPECT_FALSE(server_->receive());
  ASSERT_EQ(client_.send(Int32Message({.value = 5})), SendResult::sent);

  doorbell::drainFifo(fifo);

  while (messages_.empty()) {
    while (::poll(&readable, 1, 0) == 1 && server_->handleOne()) {
    }
    dispatcher_.runOnce(Deadline::after(1ms));
  }
  EXPECT_EQ(next().tryAs<Int32>()->value, 5);
}

// Sets all hints repeatedly until it is destroyed.
class Inventor {
 public:
  explicit Inventor(Segment segment)
      : segment_(std::move(segment)), thread_([this](const std::stop_token& stop) {
          auto& hints = segment_.at<layout::WindowHints>(0);
          while (!stop.stop_requested()) {
            for (auto& word : hints.readyWords) word.store(UINT64_MAX);
            for (auto& bits : hints.readyBits) bits.store(UINT64_MAX);
            for (auto& knock : hints.knocks) knock.store(1);
            ++hints.knocked;
          }
        }) {}

 private:
  Segment segment_;
  std::jthread thread_;
};

TEST_F(LostHintTest, FalseHintsDoNotKeepAClientFromItsDeadline) {
  runUntil([&] { return client_.isConnected(); });
  settle();
  const Inventor inventor(hintsOf(layout::SegmentKind::clientWindow));

  const auto deadline = Deadline::after(20ms);
  while (dispatcher_.runOnce(deadline)) continue;  // true: it has done something
}

TEST_F(LostHintTest, FalseHintsDoNotBlockAnEventLoop) {
  runUntil([&] { return client_.isConnected(); });
  settle();
  pollfd readable{dispatcher_.descriptor(), POLLIN, 0};
  const Inventor inventor(hintsOf(layout::SegmentKind::clientWindow));

  for (int turn = 0; turn < 3; ++turn) dispatcher_.runPending();

  ASSERT_EQ(client_.send(Int32Message({.value = 5})), SendResult::sent);
  while (!server_->handleOne()) {
  }
  while (messages_.empty()) {
    ASSERT_EQ(::poll(&readable, 1, -1), 1);
    dispatcher_.runPending();
  }
  EXPECT_EQ(next().tryAs<Int32>()->value, 5);
}

TEST_F(LostHintTest, FalseHintsBlockNeitherReceiveNorClients) {
  runUntil([&] { return client_.isConnected(); });
  settle();
  const Inventor inventor(hintsOf(layout::SegmentKind::serverWindow));

  EXPECT_FALSE(server_->receive());

  ASSERT_EQ(client_.send(Int32Message({.value = 5})), SendResult::sent);
  EXPECT_EQ(next().tryAs<Int32>()->value, 5);
}

}  // namespace
}  // namespace mpf::test
