// SPDX-License-Identifier: MIT
// Line: while a router polls it, and when the kernel has no room for what it writes.
#include <unistd.h>

#include "tests/router/transport/line_fixture.h"
#include "tests/support/replaced_yield.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

Fill closeItem(std::uint32_t number) {
  return [number](wire::Item::Builder item) { item.setClose(number); };
}

class LinePolledTest : public LineTest {
 protected:
  ~LinePolledTest() noexcept override = default;

  void SetUp() override {
    restartWithSockets();
    startGreeted();
  }
  void restartWithSockets() {
    restart();
    pipe_ = io_.provider->newTwoWayPipe();  // of the kernel, so that it has descriptors
    peer_ = kj::mv(pipe_.ends[1]);
  }
  // The read that a task has begun takes the first item. The next ones are left to poll().
  void startToPoll() {
    line_->setPolled(true);
    sendAndWait(closeItem(1));
    EXPECT_THAT(said_, SizeIs(1));
    said_.clear();
  }
  // Ends when the tasks are done that this item and the timers before it have made ready.
  void sendAndWait(const Fill& item) {
    send(frameOf({item}));
    io_.provider->getTimer().afterDelay(kj::MILLISECONDS).wait(io_.waitScope);
    settle();
  }
};

TEST_F(LinePolledTest, IsReadByPoll) {
  startToPoll();
  for (const auto number : {2, 3}) {
    sendAndWait(closeItem(static_cast<std::uint32_t>(number)));
    EXPECT_THAT(said_, IsEmpty()) << "no task reads";

    line_->poll();

    EXPECT_THAT(said_, ElementsAre(HasSubstr("close = " + std::to_string(number))));
    said_.clear();
  }
  line_->poll();
  EXPECT_THAT(said_, IsEmpty());
}

// A window is polled after the lines. In the turn in which the item was sent, no task has read it.
TEST_F(LinePolledTest, IsReadInTheTurnsOfARouterThatPolls) {
  struct Window final : router::Polled {
    explicit Window(std::function<void()> onPoll) : look(std::move(onPoll)) {}
    void poll() override {
      if (isPolled) look();  // the last poll() is of no turn
    }
    void setPolled(bool polled) override { isPolled = polled; }
    std::function<void()> look;
    bool isPolled = false;
  };
  restartWithSockets();
  router::Polling polling(io_.unixEventPort, writes_);
  polling_ = &polling;
  startGreeted();
  const auto frame = frameOf({closeItem(2)});
  std::size_t before = SIZE_MAX;
  bool isRead = false;
  Window window([&] { isRead = isRead || said_.size() > before; });
  const auto peer = KJ_ASSERT_NONNULL(peer_->getFd());
  const std::function<void()> sendInTurn = [&] {
    if (isRead) return;
    polling.noteTraffic();  // otherwise few turns follow when the processor is busy (PollBudget)
    before = said_.size();
    EXPECT_EQ(::write(peer, frame.data(), frame.size()), std::ssize(frame));
  };
  {
    const ReplacedYield replaced(sendInTurn);
    while (!isRead) {
      polling.noteTraffic();
      polling.addWindow(window);
      settle();
    }
  }
  hangUp();
  polling.remove(window);
}

TEST_F(LinePolledTest, IsReadByATaskAfterwards) {
  startToPoll();
  sendAndWait(closeItem(2));

  line_->setPolled(false);
  line_->poll();
  settle();
  EXPECT_THAT(said_, ElementsAre(HasSubstr("close = 2")));

  send(frameOf({closeItem(3)}));
  while (said_.size() == 1) settle();
  EXPECT_THAT(said_.back(), HasSubstr("close = 3"));
}

TEST_F(LinePolledTest, IsReadByATaskAfterManyPollsWithoutBytes) {
  startToPoll();
  for (int i = 0; i < 255; ++i) line_->poll();
  sendAndWait(closeItem(2));
  line_->poll();
  EXPECT_THAT(said_, SizeIs(1)) << "by poll()";

  for (int i = 0; i < 256; ++i) line_->poll();
  sendAndWait(closeItem(3));

  EXPECT_THAT(said_, SizeIs(2)) << "by a task";
}

TEST_F(LinePolledTest, ReadsAFrameThatArrivesInParts) {
  startToPoll();
  const auto frame = frameOf({closeItem(2)});
  const auto half = frame.begin() + static_cast<std::ptrdiff_t>(frame.size() / 2);

  send({frame.begin(), half});
  line_->poll();
  EXPECT_THAT(said_, IsEmpty());
  send({half, frame.end()});
  line_->poll();

  EXPECT_THAT(said_, ElementsAre(HasSubstr("close = 2")));
}

TEST_F(LinePolledTest, EndsWhenThePeerCloses) {
  startToPoll();
  peer_ = nullptr;

  line_->poll();
  settle();

  EXPECT_EQ(end_, "the peer closed the connection");
}

TEST_F(LinePolledTest, EndsWithAFarewellAtAnInvalidFrame) {
  startToPoll();
  send(Bytes(64, 0xFF));

  line_->poll();

  EXPECT_THAT(farewell(), HasSubstr("code = protocol"));
  line_->poll();
  waitForEnd();
}

TEST_F(LinePolledTest, ReadsUntilThePeerHasClosedAfterItsOwnFarewell) {
  startToPoll();
  line_->end(FarewellCode::STOPPING, "the router is stopping");
  send(frameOf({closeItem(2)}));

  line_->poll();

  EXPECT_THAT(said_, IsEmpty());
  EXPECT_THAT(farewell(), HasSubstr("code = stopping"));
  waitForEnd();
  EXPECT_EQ(end_, "the router is stopping");
}

// The answers to 5000 pings exceed SendQueue::kMaxControlItems.
TEST_F(LinePolledTest, StopsReadingFromAPeerThatDoesNotRead) {
  startToPoll();
  writes_.setDriven(true);  // and nothing calls run()
  beginToSend(frameOf(std::vector<Fill>(5000, ping(1))));

  while (record_->framesReceived != 3) {  // after the greeting and the first item
    settle();
    line_->poll();
  }
  send(frameOf({closeItem(2)}));
  for (int i = 0; i < 10; ++i) line_->poll();
  settle();
  EXPECT_THAT(said_, IsEmpty());

  writes_.setDriven(false);
  std::size_t pongs = 0;
  while (pongs < 5000) pongs += receive().size();
  line_->poll();
  EXPECT_THAT(said_, ElementsAre(HasSubstr("close = 2")));
}

// The kernel takes a part of the frame, the stream writes the rest, and the next frame follows.
TEST_F(LinePolledTest, WritesTheRestWhenTheKernelHasRoom) {
  line_->send(Carried{.isRequest = true,
                      .client = 1,
                      .requestId = 1,
                      .message = Int32ArrayMessage::allocValue(std::size_t{1} << 20)});
  settle();
  line_->send(request(2));
  settle();

  EXPECT_THAT(receiveWhileBusy(), ElementsAre(HasSubstr("requestId = 1")));
  EXPECT_THAT(receive(), ElementsAre(HasSubstr("requestId = 2")));
}

TEST_F(LinePolledTest, ReportsAWriteThatFails) {
  peer_ = nullptr;
  line_->send(request(1));

  waitForEnd();

  EXPECT_THAT(end_, HasSubstr("closed the connection"));
}

}  // namespace
}  // namespace mpf::test
