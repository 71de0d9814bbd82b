// SPDX-License-Identifier: MIT
// MessageClient::onValues(): first replies to several requests, which are delivered together.
#include <array>

#include "shm/envelope.h"
#include "shm/segment.h"
#include "tests/client/value_runs_fixture.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;

class FirstReplies : public ValueRuns {
 protected:
  // Connects, and returns requests with clientType 0 that the server has received.
  std::vector<Message> held(std::size_t count) {
    std::vector<Message> requests;
    server_->on<Int32>([&](Int32Message&& one) { requests.push_back(std::move(one)); });
    if (!client_.isConnected()) bind();
    const std::vector<Int32> values(count);
    ids_.resize(count);
    EXPECT_EQ(client_.sendMany<Int32>(values, Deadline::never(), ids_).count, count);
    runUntil([&] { return requests.size() == count; });
    return requests;
  }
  void replyInOrder(const std::vector<Message>& requests) {
    std::int32_t value = 0;
    for (const auto& request : requests) reply(request, value++);
  }
  // Sends the last reply again, as a faulty server may. Each reply fills one slot.
  void repeatLastReply() {
    for (const auto& name : backplane_.segmentNames()) {
      const auto parsed = SegmentName::tryParse(name);
      if (!parsed || parsed->kind != NameKind::link) continue;
      const auto link =
          Segment::tryOpen(name, layout::SegmentKind::link, Segment::Access::readWrite);
      const auto& header = link->header();
      const auto sent = link->at<layout::LinkControl>(layout::kLinkControlOffset)
                            .serverSent.load(std::memory_order_relaxed);
      auto* const replies = &link->at<layout::Slot>(layout::kLinkRingsOffset) + header.queueSlots;
      auto& next = replies[sent % header.replySlots];
      EnvelopeWords::in(replies[(sent - 1) % header.replySlots]).copyTo(next);
      next.sequence.store(sent + 1, std::memory_order_release);
    }
  }

  std::vector<std::uint32_t> ids_;
};

TEST_F(FirstReplies, ArriveTogetherAndEndTheirRequests) {
  startServer();
  const auto requests = held(6);

  replyInOrder(requests);
  receive(6);

  expectNumbered();
  EXPECT_EQ(runs_.size(), 1u);
  EXPECT_TRUE(runs_[0].endsRequest);
  server_.reset();
  runUntil([&] { return news_.back() == ConnectStatus::connectNo; });
  EXPECT_THAT(messages_, testing::IsEmpty()) << "no request gets a fate beside its reply";
}

TEST_F(FirstReplies, ToARunOfRequestsArriveAsOne) {
  startServer().on<Int32>([](std::span<Int32> requests) {
    for (auto& request : requests) request.value *= -1;
  });
  bind();
  ASSERT_EQ(client_.sendMany<Int32>(readings(6, 1)).count, 6u);

  receive(6);

  EXPECT_THAT(valuesOfRuns(), ElementsAre(ElementsAre(-1, -2, -3, -4, -5, -6)));
}

TEST_F(FirstReplies, OfRequestsWithOtherMarksArriveApart) {
  startServer();
  auto requests = held(2);
  requests.push_back(another(7));
  requests.push_back(another(7));

  replyInOrder(requests);
  receive(4);

  EXPECT_THAT(valuesOfRuns(), ElementsAre(ElementsAre(0, 1), ElementsAre(2, 3)));
  EXPECT_EQ(runs_[1].clientType, 7);
  EXPECT_EQ(runs_[1].clientExtra, -7);
}

TEST_F(FirstReplies, AndFurtherOnesArriveApart) {
  startServer();
  const auto requests = held(3);

  reply(requests[0], 0);
  reply(requests[1], 1);
  reply(requests[1], 2);
  reply(requests[2], 3);
  receive(4);

  EXPECT_THAT(valuesOfRuns(), ElementsAre(ElementsAre(0, 1), ElementsAre(2), ElementsAre(3)));
  EXPECT_TRUE(runs_[0].endsRequest);
  EXPECT_FALSE(runs_[1].endsRequest);
  EXPECT_TRUE(runs_[2].endsRequest);
}

TEST_F(FirstReplies, ToACancelledRequestAreNotDelivered) {
  startServer();
  const auto requests = held(4);
  client_.cancel(ids_[2]);
  EXPECT_EQ(fateOf(next()), Fate::cancelled);

  replyInOrder(requests);
  receive(3);

  EXPECT_THAT(valuesOfRuns(), ElementsAre(ElementsAre(0, 1), ElementsAre(3)));
}

TEST_F(FirstReplies, WithAnotherTimeStampArriveApart) {
  startServer();
  const auto requests = held(3);

  reply(requests[0], 0, 5);
  reply(requests[1], 1, 5);
  reply(requests[2], 2, 6);
  receive(3);

  EXPECT_THAT(valuesOfRuns(), ElementsAre(ElementsAre(0, 1), ElementsAre(2)));
}

// A faulty server sends a first reply twice: the second one is not delivered.
TEST_F(FirstReplies, ToOneRequestAreDeliveredOnce) {
  startServer();
  const auto requests = held(2);
  reply(requests[0], 0);
  reply(requests[1], 1);
  repeatLastReply();

  receive(2);
  dispatcher_.runOnce(Deadline::after(1ms));

  expectNumbered();
}

TEST_F(FirstReplies, LetMoreRequestsBeSentFromTheCallback) {
  startServer({.queueSize = 256}).on<Int32>([](std::span<Int32>) {});
  bind();
  std::int32_t sent = 50;
  onCall_ = [&](std::span<const Int32> values, const Message&) {
    if (sent == 500) return;
    const auto more = readings(static_cast<std::int32_t>(values.size()), sent);
    EXPECT_EQ(client_.sendMany<Int32>(more).count, more.size());
    sent += static_cast<std::int32_t>(more.size());
  };
  ASSERT_EQ(client_.sendMany<Int32>(readings(50)).count, 50u);

  runUntil([&] { return received_ >= 500; });
  onCall_ = nullptr;
  runUntil([&] { return received_ == static_cast<std::size_t>(sent); });

  expectNumbered();
}

}  // namespace
}  // namespace mpf::test
