// SPDX-License-Identifier: MIT
// Link: two rings and two pools between a client and a server.
#include <cstring>
#include <map>

#include "tests/shm/link_fixture.h"
#include "tests/support/random.h"

namespace mpf::test {
namespace {

using layout::LinkState;
using testing::HasSubstr;

constexpr std::size_t kLarge = layout::kInlineBodyBytes + 1;  // does not fit into the ring

class BodySizes : public LinkTest, public testing::WithParamInterface<std::size_t> {};

TEST_P(BodySizes, CrossInBothDirections) {
  const auto link = makeLink({.maxMessageBytes = 8 << 20, .maxPoolBytes = 32 << 20});
  const auto body = filled(GetParam());

  ASSERT_EQ(sendBody(link.client, body), LinkSend::sent);
  ASSERT_EQ(sendBody(link.server, body), LinkSend::sent);

  EXPECT_EQ(take(link.server), body);
  EXPECT_EQ(take(link.client), body);
}
INSTANTIATE_TEST_SUITE_P(InLineAndInChunks, BodySizes,
                         testing::Values(0, 1, 24, 25, 80, 192, 193, 4096, 100'000, 8 << 20));

TEST_F(LinkTest, AChunkIsReadInPlaceAndSentBackUnchanged) {
  const auto link = makeLink();
  const auto built = *link.client.tryAlloc(5000);
  built.data[4999] = std::byte{7};

  ASSERT_EQ(sendBody(link.client, {built.data, 5000}), LinkSend::sentInPlace);
  const auto borrowed = link.server.tryChunk(link.server.incoming().begin().bodyBytes);
  link.server.incoming().end();
  ASSERT_TRUE(borrowed);
  EXPECT_EQ(borrowed->data[4999], std::byte{7});
  ASSERT_EQ(sendBody(link.server, {borrowed->data, 5000}), LinkSend::sentInPlace);
  const auto back = link.client.tryChunk(link.client.incoming().begin().bodyBytes);
  link.client.incoming().end();

  ASSERT_TRUE(back);
  EXPECT_EQ(back->data, built.data);
  link.client.release(back->data);
}

TEST_F(LinkTest, RefusesABodyAboveTheServersLimit) {
  const auto link = makeLink({.maxMessageBytes = 1000});

  EXPECT_EQ(sendBody(link.client, filled(1001)), LinkSend::tooLarge);
  EXPECT_EQ(sendBody(link.client, filled(1000)), LinkSend::sent);

  EXPECT_EQ(take(link.server), filled(1000));
  EXPECT_FALSE(link.server.incoming().hasMessage());
}

TEST_F(LinkTest, RefusesABodyLongerThanAnEnvelopeCanRepresent) {
  const auto link = makeLink({.maxMessageBytes = UINT64_MAX});

  EXPECT_EQ(link.client.maxMessageBytes(), UINT32_MAX);
  EXPECT_EQ(link.server.maxMessageBytes(), UINT32_MAX);
}

TEST_F(LinkTest, SendsAndLosesNothingWithoutMemory) {
  const auto link = makeLink({.maxPoolBytes = 64 << 10});
  std::vector<Chunk> held;
  while (const auto chunk = link.client.tryAlloc(10'000)) held.push_back(*chunk);
  ASSERT_FALSE(held.empty());

  EXPECT_EQ(sendBody(link.client, filled(10'000)), LinkSend::noMemory);

  EXPECT_FALSE(link.server.incoming().hasMessage());
  link.client.release(held.back().data);
  EXPECT_EQ(sendBody(link.client, filled(10'000)), LinkSend::sent);
  EXPECT_EQ(take(link.server), filled(10'000));
}

TEST_F(LinkTest, AcceptsMessagesUpToTheLimitOfTheQueue) {
  const auto link = makeLink({.queueSize = 4});
  for (int i = 0; i < 4; ++i)
    ASSERT_EQ(sendBody(link.client, filled(kLarge), {.waiting = 4}), LinkSend::sent);

  EXPECT_EQ(sendBody(link.client, filled(8), {.waiting = 4}), LinkSend::full);

  EXPECT_EQ(take(link.server), filled(kLarge));
  EXPECT_EQ(sendBody(link.client, filled(8), {.waiting = 4}), LinkSend::sent);
}

// Long messages in the ring must not use the slots of short ones that the queue may still accept.
TEST_F(LinkTest, AQueueHasItsFullLengthWithBodiesOfAnySize) {
  for (const std::uint32_t queue : {1u, 2u, 14u, 100u}) {
    const auto link = makeLink({.queueSize = queue});
    Random random;
    for (int round = 0; round < 20; ++round) {
      for (std::uint32_t i = 0; i < queue; ++i) {
        ASSERT_EQ(sendBody(link.client, filled(random.below(300)), {.waiting = queue}),
                  LinkSend::sent)
            << i << " of " << queue;
      }
      ASSERT_EQ(sendBody(link.client, filled(1), {.waiting = queue}), LinkSend::full);
      for (std::uint32_t i = 0; i < queue; ++i) take(link.server);
    }
    client_.reset();
    server_.reset();
  }
}

TEST_F(LinkTest, EachSideSetsItsStateAndSeesThePeersState) {
  const auto link = makeLink();
  EXPECT_EQ(link.server.peerState(), LinkState::open) << "a client that knocks is open";
  EXPECT_EQ(link.client.peerState(), LinkState::none);

  link.server.setState(LinkState::open);
  EXPECT_EQ(link.client.peerState(), LinkState::open);
  link.client.setState(LinkState::closed);

  EXPECT_EQ(link.server.peerState(), LinkState::closed);
  EXPECT_EQ(link.client.peerState(), LinkState::open);
}

TEST_F(LinkTest, SetsTheReadyBitWhileTheReceiverDoesNotPoll) {
  const auto link = makeLink();
  auto& hints = server_->endpoint.window().hints();
  const auto takeBits = [&] { return hints.readyBits[0].exchange(0, std::memory_order_relaxed); };
  takeBits();

  link.server.watch(true);
  ASSERT_EQ(sendBody(link.client, filled(1)), LinkSend::sent);
  EXPECT_EQ(takeBits(), 0u);
  Link::execute(link.server.unwatch());
  ASSERT_EQ(sendBody(link.client, filled(1)), LinkSend::sent);
  EXPECT_EQ(takeBits(), std::uint64_t{1} << link.serverIndex);

  take(link.server);
  take(link.server);
}

TEST_F(LinkTest, ABatchSetsTheReadyBitAtItsEnd) {
  const auto link = makeLink();
  auto& hints = server_->endpoint.window().hints();
  const auto takeBits = [&] { return hints.readyBits[0].exchange(0, std::memory_order_relaxed); };
  takeBits();
  {
    const Link::Batch batch(link.client);

    ASSERT_EQ(sendBody(link.client, filled(1)), LinkSend::sent);
    ASSERT_EQ(sendBody(link.client, filled(100)), LinkSend::sent);
    EXPECT_EQ(takeBits(), 0u);
  }

  EXPECT_EQ(takeBits(), std::uint64_t{1} << link.serverIndex);
  take(link.server);
  take(link.server);
}

TEST_F(LinkTest, EachSideRemovesItsFilesAtDestruction) {
  const auto link = makeLink();
  const auto before = backplane_.segmentNames().size();
  ASSERT_TRUE(link.client.tryAlloc(1000) && link.server.tryAlloc(1000));
  ASSERT_EQ(backplane_.segmentNames().size(), before + 2);

  client_->drop(link.clientIndex);
  EXPECT_EQ(backplane_.segmentNames().size(), before) << "the server's pool is left";
  server_->drop(link.serverIndex);

  EXPECT_EQ(backplane_.segmentNames().size(), before - 1);
}

TEST_F(LinkTest, DoesNotOpenALinkThatDoesNotExist) {
  makeEnds();

  EXPECT_EQ(Link::tryOpen(name(), SegmentName::link(name(), 1, 2), server_->endpoint.window()),
            nullptr);
}

using Header = layout::SegmentHeader;
class Geometries : public LinkTest, public testing::WithParamInterface<void (*)(Header&)> {};

TEST_P(Geometries, AreRefusedIfTheServerDidNotOfferThem) { EXPECT_NE(refusal(GetParam()), ""); }
INSTANTIATE_TEST_SUITE_P(Invalid, Geometries,
                         testing::Values([](Header& header) { header.queueSize = 0; },
                                         [](Header& header) { header.queueSize = 16385; },
                                         [](Header& header) { header.queueSize = 1u << 30; },
                                         [](Header& header) { header.queueSize = UINT32_MAX; },
                                         [](Header& header) { header.queueSlots = 0; },
                                         [](Header& header) { header.queueSlots = 3; },
                                         [](Header& header) { header.queueSlots *= 2; },
                                         [](Header& header) { header.replySlots = UINT32_MAX; },
                                         [](Header& header) { header.replySlots /= 2; },
                                         [](Header& header) { header.moreReplySlots *= 2; },
                                         [](Header& header) { header.moreReplySlots = 64; },
                                         [](Header& header) { header.maxOutstanding = UINT32_MAX; },
                                         [](Header& header) { ++header.serverWindow; },
                                         [](Header& header) { ++header.incarnation; },
                                         [](Header& header) { ++header.maxMessageBytes; },
                                         [](Header& header) { ++header.maxPoolBytes; },
                                         [](Header& header) { header.totalBytes = UINT64_MAX; }));

TEST_F(LinkTest, RefusesALinkFileThatIsTooShortForItsRings) {
  const auto link = makeLink();
  const auto bytes = link.client.header().totalBytes - 1;
  Segment::tryOpen(link.client.name(), layout::SegmentKind::link, Segment::Access::readWrite)
      ->sharedHeader()
      .totalBytes = bytes;
  ASSERT_EQ(::truncate(segments::path(link.client.name()).c_str(), static_cast<off_t>(bytes)), 0);

  EXPECT_THAT(whatOf<SegmentError>(
                  [&] { Link::tryOpen(name(), link.client.name(), server_->endpoint.window()); }),
              HasSubstr(segments::path(link.client.name())));
}

// The chunk of a message; nullopt also if it is unavailable because the peer has overwritten its
// state with "closed".
std::optional<Chunk> chunkOf(Link& link, const Envelope& envelope) try {
  return link.tryChunk(envelope.bodyBytes);
} catch (const ChunkUnavailable&) {
  return std::nullopt;
}

// The client may write every byte of the link and of its own pool at any time. Each call of the
// server must return, stay inside the memory that it mapped, and give memory to one holder only.
TEST_F(LinkTest, APeerThatWritesInvalidDataDoesNotCrashOrBlockTheOtherSide) {
  Random random;
  const auto link = makeLink({.maxPoolBytes = 4 << 20});
  auto scribbled =
      *Segment::tryOpen(link.client.name(), layout::SegmentKind::link, Segment::Access::readWrite);
  ASSERT_EQ(sendBody(link.client, filled(1000)), LinkSend::sent);
  auto bulk = *Segment::tryOpen(SegmentName::bulk(name(), link.client.header().incarnation, 0, 0),
                                layout::SegmentKind::bulk, Segment::Access::readWrite);
  std::vector<std::byte> body(layout::kInlineBodyBytes);
  std::map<std::byte*, std::size_t> held;
  std::uint64_t sum = 0;
  std::uint64_t taken = 0;
  std::uint64_t position = 0;  // of the server in the ring
  const auto nextSlot = [&]() -> layout::Slot& {
    const auto index = position % link.client.header().queueSlots;
    return scribbled.at<layout::Slot>(layout::kLinkRingsOffset + index * sizeof(layout::Slot));
  };

  for (int step = 0; step < 200'000; ++step) {
    switch (random.below(8)) {
      case 0:
      case 1:
        scribbled.data()[random.below(scribbled.bytes())] = static_cast<std::byte>(random.bits());
        break;
      case 2:
        scribbled.at<std::uint64_t>(random.below(scribbled.bytes() / 8) * 8) = random.nasty();
        break;
      case 3: {  // the next message, with a chunk that may exist
        auto& slot = nextSlot();
        slot.flags = static_cast<std::uint8_t>(random.below(4));
        slot.bodyBytes =
            static_cast<std::uint32_t>(random.oneIn(2) ? random.below(2000) : random.nasty());
        slot.slots = static_cast<std::uint8_t>(random.below(6));
        const layout::ChunkRef ref{static_cast<std::uint32_t>(random.below(3)),
                                   static_cast<std::uint32_t>(random.below(300)),
                                   static_cast<std::uint32_t>(random.below(3)), 0};
        std::memcpy(slot.body.data(), &ref, sizeof ref);
        slot.sequence.store(position + 1, std::memory_order_relaxed);
        break;
      }
      case 4:
        bulk.data()[random.below(512)] = static_cast<std::byte>(random.bits());
        break;
      case 5:
        static_cast<void>(sendBody(link.server, filled(random.below(3000)),
                                   {.waiting = static_cast<std::uint32_t>(random.below(100))}));
        break;
      case 6:
        if (!held.empty()) {
          link.server.release(held.begin()->first);
          held.erase(held.begin());
        } else if (const auto chunk = link.server.tryAlloc(random.below(10'000))) {
          ASSERT_TRUE(held.emplace(chunk->data, chunk->capacity).second);
          std::memset(chunk->data, 1, chunk->capacity);
        }
        break;
      default:
        if (!link.server.incoming().hasMessage()) break;
        const auto slots = nextSlot().slots;
        const auto envelope = link.server.incoming().begin();
        ++taken;
        if ((envelope.flags & layout::kSlotChunk) != 0) {
          if (const auto chunk = chunkOf(link.server, envelope)) {
            ASSERT_LE(envelope.bodyBytes, chunk->capacity);
            for (std::uint32_t i = 0; i < envelope.bodyBytes; ++i)
              sum += static_cast<std::uint64_t>(chunk->data[i]);
            link.server.release(chunk->data);
            held.erase(chunk->data);
          }
        } else {
          link.server.incoming().copyBody(std::span(body).first(
              std::min<std::size_t>(envelope.bodyBytes, link.server.incoming().inlineCapacity())));
        }
        link.server.incoming().end();
        position += slots >= 1 && slots <= layout::kMaxMessageSlots ? slots : 1;
    }
  }

  EXPECT_GT(taken, 1000u);
  std::cout << "taken " << taken << ", sum " << sum << '\n';
}

}  // namespace
}  // namespace mpf::test
