// SPDX-License-Identifier: MIT
// Publisher: one message reaches many clients without a copy, and a client that takes none, dies or
// writes invalid data costs the others nothing.
#include "server/publisher.h"

#include <algorithm>
#include <set>
#include <vector>

#include "tests/base/child_process.h"
#include "tests/server/server_parts_fixture.h"
#include "tests/support/random.h"

namespace mpf::test {
namespace {

class PublisherTest : public ServerPartsTest {
 protected:
  static constexpr int kMaxBorrowed = 3;
  static constexpr std::size_t kElements = 50'000;

  // The client's end of a link, and the request that the server keeps of it.
  struct Subscriber {
    Link& link;
    Connection& connection;
    Message request;
  };
  Subscriber subscribe(std::uint32_t requestId = 7) {
    auto& link = createLink();
    auto& connection = accept(link);
    Int32Message request;
    request.setRoute(noteRequest(connection, requestId));
    request.setClientExtra(static_cast<std::int32_t>(requestId) + 1);
    return {link, connection, std::move(request)};
  }
  Float64ArrayMessage filled(double with) {
    auto message = Float64ArrayMessage::inBuffer(
        publisher_->allocate(Float64ArrayMessage::bytesFor(kElements)), kElements);
    std::ranges::fill(message.value(), with);
    return message;
  }
  ReplyResult publish(const Message& message, const Message& request) {
    ReplyResult result{};
    publisher_->publish(message, std::span(&request, 1), std::span(&result, 1));
    return result;
  }
  // The chunk of the next message that the client receives.
  static Chunk borrow(Link& link) {
    const auto envelope = link.incoming().begin();
    const auto chunk = link.tryChunk(envelope.bodyBytes);
    link.incoming().end();
    EXPECT_TRUE(chunk);
    return chunk.value_or(Chunk{});
  }
  static double elementOf(const Chunk& chunk) {
    return *reinterpret_cast<const double*>(chunk.data + sizeof(Float64Array));
  }
  [[nodiscard]] std::size_t files() const {
    return static_cast<std::size_t>(std::ranges::count_if(
        backplane_.segmentNames(),
        [](const auto& name) { return SegmentName::tryParse(name)->kind == NameKind::fanOut; }));
  }
  void TearDown() override {
    static_cast<void>(connections_.closeAll());
    publisher_.reset();
    ServerPartsTest::TearDown();
  }

  ServerOptions options_{.maxSharedBytes = 32u << 20, .maxBorrowed = kMaxBorrowed};
  std::optional<Publisher> publisher_{std::in_place, name(), server_->endpoint.window(), counts_,
                                      options_};
};

TEST_F(PublisherTest, EachClientReadsTheSameChunkAndGetsTheMarksOfItsOwnRequest) {
  auto one = subscribe(7);
  auto two = subscribe(9);
  auto message = filled(1.5);
  message.setTimeStampNs(77);

  EXPECT_EQ(publish(message, one.request), ReplyResult::sent);
  EXPECT_EQ(publish(message, two.request), ReplyResult::sent);

  EXPECT_EQ(files(), 1u);
  for (auto* subscriber : {&one, &two}) {
    const auto envelope = subscriber->link.incoming().begin();
    EXPECT_EQ(envelope.requestId, subscriber->request.route().requestId);
    EXPECT_EQ(envelope.clientExtra, subscriber->request.getClientExtra());
    EXPECT_EQ(envelope.timeNs, 77);
    EXPECT_NE(envelope.flags & layout::kSlotFirstReply, 0);
    const auto chunk = subscriber->link.tryChunk(envelope.bodyBytes);
    ASSERT_TRUE(chunk);
    EXPECT_EQ(elementOf(*chunk), 1.5);
    EXPECT_TRUE(chunk->isFanOut);
  }
}

TEST_F(PublisherTest, TheFirstReplyEndsTheRequestAndFurtherOnesFollow) {
  auto subscriber = subscribe(7);
  const auto message = filled(1);

  ASSERT_EQ(publish(message, subscriber.request), ReplyResult::sent);
  EXPECT_FALSE(subscriber.connection.isUnanswered(7));
  ASSERT_EQ(publish(message, subscriber.request), ReplyResult::sent);

  EXPECT_NE(take(subscriber.link).flags & layout::kSlotFirstReply, 0);
  EXPECT_EQ(take(subscriber.link).flags & layout::kSlotFirstReply, 0);
}

TEST_F(PublisherTest, AClientThatReturnsNothingGetsABoundedNumberAndIsToldWhatItMissed) {
  auto slow = subscribe();
  auto quick = subscribe();
  for (int i = 0; i < 100; ++i) {
    const auto message = filled(i);
    ASSERT_EQ(publish(message, slow.request),
              i < kMaxBorrowed ? ReplyResult::sent : ReplyResult::queueFull);
    ASSERT_EQ(publish(message, quick.request), ReplyResult::sent);
    const auto chunk = borrow(quick.link);
    ASSERT_EQ(elementOf(chunk), i);
    ASSERT_EQ(chunk.missed, 0u);
    quick.link.release(chunk.data);
  }
  EXPECT_LE(files(), kMaxBorrowed + 3u);
  EXPECT_EQ(valueOf(control().replyQueueFull), 100u - kMaxBorrowed);

  for (int i = 0; i < kMaxBorrowed; ++i) {
    const auto chunk = borrow(slow.link);
    EXPECT_EQ(elementOf(chunk), i);
    EXPECT_EQ(chunk.missed, 0u);
    slow.link.release(chunk.data);
  }
  ASSERT_EQ(publish(filled(100), slow.request), ReplyResult::sent);
  ASSERT_EQ(publish(filled(101), slow.request), ReplyResult::sent);

  EXPECT_EQ(borrow(slow.link).missed, 100u - kMaxBorrowed);
  EXPECT_EQ(borrow(slow.link).missed, 0u);
}

TEST_F(PublisherTest, EachRequestOfAClientIsToldItsOwnNumber) {
  auto subscriber = subscribe(7);
  Int32Message other;
  other.setRoute(noteRequest(subscriber.connection, 8));
  for (int i = 0; i < kMaxBorrowed; ++i) ASSERT_EQ(publish(filled(0), other), ReplyResult::sent);
  for (int i = 0; i < 5; ++i)
    ASSERT_EQ(publish(filled(0), subscriber.request), ReplyResult::queueFull);
  for (int i = 0; i < kMaxBorrowed; ++i) subscriber.link.release(borrow(subscriber.link).data);

  ASSERT_EQ(publish(filled(0), other), ReplyResult::sent);
  ASSERT_EQ(publish(filled(0), subscriber.request), ReplyResult::sent);

  EXPECT_EQ(borrow(subscriber.link).missed, 0u);
  EXPECT_EQ(borrow(subscriber.link).missed, 5u);
}

TEST_F(PublisherTest, FindsFreeChunksAlsoWhenNothingCanBeSent) {
  auto subscriber = subscribe();
  options_.maxSharedBytes = 2u << 20;  // four chunks
  publisher_.emplace(name(), server_->endpoint.window(), counts_, options_);
  std::vector<Float64ArrayMessage> kept;
  for (int i = 0; i < kMaxBorrowed; ++i)
    ASSERT_EQ(publish(filled(i), subscriber.request), ReplyResult::sent);
  while (filled(0).lender() != &heapLender()) kept.push_back(filled(0));
  kept.clear();
  const auto last = filled(0);
  EXPECT_NE(last.lender(), &heapLender());
  for (int i = 0; i < kMaxBorrowed; ++i) subscriber.link.release(borrow(subscriber.link).data);

  EXPECT_NE(filled(0).lender(), &heapLender()) << "what the client returned was not noticed";
}

TEST_F(PublisherTest, AMessageFromElsewhereIsCopiedOnce) {
  auto one = subscribe();
  auto two = subscribe();
  auto heap = Float64ArrayMessage::allocValue(kElements);
  std::ranges::fill(heap.value(), 4.0);

  EXPECT_EQ(publish(heap, one.request), ReplyResult::sent);
  EXPECT_EQ(publish(Int32Message({.value = 5}), two.request), ReplyResult::sent);

  EXPECT_EQ(elementOf(borrow(one.link)), 4.0);
  EXPECT_EQ(reinterpret_cast<Int32*>(borrow(two.link).data)->value, 5);
}

TEST_F(PublisherTest, RefusesWhatIsNoRequestOfThisServer) {
  auto subscriber = subscribe();
  const auto message = filled(0);
  const auto request = subscriber.request.duplicate();
  connections_.close(subscriber.connection);

  EXPECT_EQ(publish(message, request), ReplyResult::clientGone);
  EXPECT_EQ(publish(message, Message()), ReplyResult::clientGone);
  EXPECT_EQ(publish(message, message), ReplyResult::clientGone);
  EXPECT_EQ(publish(Message(), request), ReplyResult::clientGone);
}

TEST_F(PublisherTest, AHandleThatWasMovedFromIsNoRequest) {
  auto subscriber = subscribe();
  const auto request = std::move(subscriber.request);

  // NOLINTNEXTLINE(bugprone-use-after-move): it is empty, and keeps its route
  EXPECT_EQ(publish(filled(0), subscriber.request), ReplyResult::clientGone);

  EXPECT_FALSE(subscriber.link.incoming().hasMessage());
}

TEST_F(PublisherTest, RefusesATooLargeMessageWithoutCountingIt) {
  auto subscriber = subscribe();
  const auto large = Char8ArrayMessage::allocValue((1 << 20) + 1);  // Offer::maxMessageBytes

  EXPECT_EQ(publish(large, subscriber.request), ReplyResult::tooLarge);
  EXPECT_EQ(publish(filled(0), subscriber.request), ReplyResult::sent);

  EXPECT_EQ(borrow(subscriber.link).missed, 0u);
}

TEST_F(PublisherTest, CountsWhatItHasNoMemoryFor) {
  auto subscriber = subscribe();
  options_.maxSharedBytes = 0;
  publisher_.emplace(name(), server_->endpoint.window(), counts_, options_);
  EXPECT_EQ(filled(0).lender(), &heapLender());
  EXPECT_EQ(publish(filled(0), subscriber.request), ReplyResult::noMemory);
  options_.maxSharedBytes = 1u << 20;
  publisher_.emplace(name(), server_->endpoint.window(), counts_, options_);

  ASSERT_EQ(publish(filled(0), subscriber.request), ReplyResult::sent);

  EXPECT_EQ(borrow(subscriber.link).missed, 1u);
}

TEST_F(PublisherTest, AClientThatLeavesWhileItReadsKeepsItsMessageUnchanged) {
  auto reader = subscribe();
  ASSERT_EQ(publish(filled(1), reader.request), ReplyResult::sent);
  const auto chunk = borrow(reader.link);

  reader.link.setState(layout::LinkState::closed);
  connections_.closeIfClientClosed(reader.connection);
  for (int i = 0; i < 20; ++i) filled(2);

  EXPECT_EQ(elementOf(chunk), 1.0);
  EXPECT_EQ(files(), 1u) << "the file of the message is removed, not only its name kept";
}

TEST_F(PublisherTest, ABodyMayOutliveTheServer) {
  auto message = filled(3);
  publisher_.reset();

  EXPECT_EQ(files(), 0u);
  EXPECT_EQ(message.value()[kElements - 1], 3.0);
}

// Another thread of the parent may have held the mutex at the fork.
TEST_F(PublisherTest, LendsNothingInTheChildOfAFork) {
  const auto bodies = std::make_shared<FanOutBodies>();
  FanOutPool pool(name(), server_->endpoint.window().header().incarnation, {}, 1u << 20);
  const auto body = bodies->lend(pool.tryAlloc(1000), 1000);
  const auto owners = bodies.use_count();

  const auto status = endOf([&] {
    EXPECT_EQ(bodies->tryFind(body.data), nullptr);
    bodies->takeBack(body.data, body.capacity);
    EXPECT_EQ(bodies.use_count(), owners) << "nothing was taken back";
    return HasFailure() ? 1 : 0;
  });

  EXPECT_EQ(status, 0);
  EXPECT_NE(bodies->tryFind(body.data), nullptr);
  bodies->takeBack(body.data, body.capacity);
}

TEST_F(PublisherTest, RefusesAnInvalidLimit) {
  for (const int invalid : {0, -1, 65}) {
    options_.maxBorrowed = invalid;
    EXPECT_EQ(whatOf<std::invalid_argument>(
                  [&] { Publisher(name(), server_->endpoint.window(), counts_, options_); }),
              "max borrowed " + std::to_string(invalid) + ": use 1 to 64");
  }
}

// A client returns chunks that it does not hold, or holds no more, and writes wrong counts. The
// other client sees each message whole while it holds it.
TEST_F(PublisherTest, InvalidReturnsOfOneClientChangeNothingForAnother) {
  Random random;
  auto mad = subscribe();
  auto honest = subscribe();
  auto& returns = mad.link.control().replyChunks;
  std::vector<std::pair<Chunk, double>> held;
  for (int i = 0; i < 3000; ++i) {
    for (int writes = 0; writes < 4; ++writes) {
      const auto word = static_cast<std::uint32_t>(
          random.oneIn(4) ? random.nasty() : layout::kReturnsFanOut | random.below(8));
      returns.chunks[random.below(returns.chunks.size())].store(word, std::memory_order_relaxed);
    }
    returns.returned.fetch_add(random.oneIn(50) ? random.nasty() : random.below(3),
                               std::memory_order_relaxed);
    const auto message = filled(i);
    const auto toMad = publish(message, mad.request);
    ASSERT_TRUE(toMad == ReplyResult::sent || toMad == ReplyResult::queueFull);
    while (mad.link.incoming().hasMessage()) take(mad.link);
    if (held.size() < kMaxBorrowed) {
      ASSERT_EQ(publish(message, honest.request), ReplyResult::sent);
      held.emplace_back(borrow(honest.link), i);
    } else {
      honest.link.release(held.front().first.data);
      held.erase(held.begin());
    }
    for (const auto& [chunk, value] : held) {
      ASSERT_EQ(elementOf(chunk), value);
      const auto* last = reinterpret_cast<const double*>(chunk.data + sizeof(Float64Array));
      ASSERT_EQ(last[kElements - 1], value);
    }
  }
  EXPECT_LE(files(), 2u * kMaxBorrowed + 3);
}

}  // namespace
}  // namespace mpf::test
