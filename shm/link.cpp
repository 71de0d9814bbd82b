// SPDX-License-Identifier: MIT
#include "shm/link.h"

#include <unistd.h>

#include <fmt/format.h>
#include <utility>

#include <mpf/clock.h>

#include "base/step.h"
#include "shm/notice_batch.h"
#include "shm/segment_name.h"

namespace mpf {
namespace {

layout::Slot* slotsOf(const Segment& segment, LinkSide producer) {
  auto* slots = &segment.at<layout::Slot>(layout::kLinkRingsOffset);
  return producer == LinkSide::client ? slots : slots + segment.header().queueSlots;
}

std::uint32_t slotCount(const Segment& segment, LinkSide producer) {
  return producer == LinkSide::client ? segment.header().queueSlots : segment.header().replySlots;
}

// The second ring of a direction: only replies may have one.
SecondRing secondRing(const Segment& segment, LinkSide producer) {
  const auto& header = segment.header();
  if (producer == LinkSide::client || header.moreReplySlots == 0) return {};
  auto& control = segment.at<layout::LinkControl>(layout::kLinkControlOffset);
  return {slotsOf(segment, producer) + header.replySlots, header.moreReplySlots,
          &control.hasMoreReplies, &control.repliesMoved};
}

std::size_t linkBytes(const LinkGeometry& geometry) {
  return layout::linkBytes(geometry.queueSlots, geometry.replySlots, geometry.moreReplySlots);
}

// What a side writes about the messages and the bodies that it receives.
struct ReceiverWords {
  layout::RingControl& ring;
  std::atomic<layout::Watch>& watch;
  layout::Word32& polledOn;
  layout::ReturnRing& returns;
};
ReceiverWords wordsOf(const Segment& segment, LinkSide receiver) {
  auto& all = segment.at<layout::LinkControl>(layout::kLinkControlOffset);
  if (receiver == LinkSide::client)
    return {all.replies, all.replyWatch, all.repliesPolledOn, all.replyChunks};
  return {all.requests, all.requestWatch, all.requestsPolledOn, all.requestChunks};
}

LinkSide other(LinkSide side) {
  return side == LinkSide::client ? LinkSide::server : LinkSide::client;
}

PoolPlace poolPlace(const Segment& segment, std::string_view backplane, LinkSide side) {
  const auto& header = segment.header();
  return {backplane, header.incarnation, static_cast<std::uint32_t>(side),
          side == LinkSide::client ? header.clientWindow : header.serverWindow};
}

void checkGeometry(const layout::SegmentHeader& header, const std::string& name) {
  const auto queueSize = std::clamp(header.queueSize, 1u, LinkGeometry::kMaxQueueSize);
  const auto expected = LinkGeometry::forQueue(queueSize);
  if (header.queueSize != queueSize || header.queueSlots != expected.queueSlots ||
      header.replySlots != expected.replySlots ||
      header.moreReplySlots != expected.moreReplySlots ||
      header.maxOutstanding != expected.maxOutstanding) {
    throw SegmentError(fmt::format(
        "{}: rings of {}, {} and {} slots do not fit a queue of {} messages", segments::path(name),
        header.queueSlots, header.replySlots, header.moreReplySlots, header.queueSize));
  }
}

}  // namespace

LinkGeometry LinkGeometry::forQueue(std::uint32_t queueSize) noexcept {
  const auto maxOutstanding = 2 * queueSize;
  const auto streamed = std::max(16u, queueSize / 8);  // replies beyond the first one of a request
  const auto replySlots = ringSlotsFor(maxOutstanding + streamed);
  // Most clients have few unanswered requests: they need a quarter of this.
  constexpr std::uint32_t kLeastSlots = 64;
  const auto first = std::max(kLeastSlots, replySlots / 4);
  const bool hasSecond = first < replySlots;
  return {.queueSlots = ringSlotsFor(queueSize),
          .replySlots = hasSecond ? first : replySlots,
          .moreReplySlots = hasSecond ? replySlots : 0,
          .maxOutstanding = maxOutstanding,
          .firstOutstanding = hasSecond ? first / 4 : maxOutstanding};
}

Rights Link::rightsAt(const PeerWindow& server) {
  Rights rights{server.header().linkMode & 0666, server.header().linkGroup};
  // Root may open the window of any user, but the server could not open a link that root owns.
  if (::geteuid() == 0 && (rights.mode & 0006u) != 0006u) rights.user = server.user();
  return rights;
}

std::unique_ptr<Link> Link::create(const std::string& backplane, const OwnWindow& own,
                                   std::uint32_t index, std::shared_ptr<PeerWindow> server) {
  const auto& offer = server->header();
  const auto queueSize = std::clamp(server->control().queueSize.load(std::memory_order_relaxed), 1u,
                                    LinkGeometry::kMaxQueueSize);
  const auto geometry = LinkGeometry::forQueue(queueSize);
  const auto rights = rightsAt(*server);
  auto segment = Segment::create(linkBytes(geometry), layout::SegmentKind::link, backplane, rights,
                                 layout::linkBytes(geometry.queueSlots, geometry.replySlots, 0));
  auto& header = segment.sharedHeader();
  header.ownerWindow = own.header().incarnation;
  header.clientWindow = own.header().incarnation;
  header.clientIndex = index;
  header.serverWindow = offer.incarnation;
  header.location = offer.location;
  header.name = offer.name;
  header.queueSlots = geometry.queueSlots;
  header.replySlots = geometry.replySlots;
  header.moreReplySlots = geometry.moreReplySlots;
  header.queueSize = queueSize;
  header.maxOutstanding = geometry.maxOutstanding;
  header.maxMessageBytes = offer.maxMessageBytes;
  header.maxPoolBytes = offer.maxPoolBytes;
  header.linkMode = offer.linkMode;
  header.linkGroup = offer.linkGroup;
  header.ringBytesOffset = layout::kLinkControlOffset;
  auto& control = segment.at<layout::LinkControl>(layout::kLinkControlOffset);
  control.clientState.store(layout::LinkState::open, std::memory_order_relaxed);
  control.requestWatch.store(layout::Watch::unwatched, std::memory_order_relaxed);
  control.replyWatch.store(layout::Watch::unwatched, std::memory_order_relaxed);
  segment.completeHeader();
  auto link =
      std::unique_ptr<Link>(new Link(std::move(segment), backplane, LinkSide::client, rights));
  // Last, because nothing may fail after the file has its name.
  const auto name = SegmentName::link(backplane, offer.incarnation, header.incarnation);
  if (!link->segment_.tryPublish(name))
    throw SegmentError(fmt::format("{}: duplicate incarnation number", segments::path(name)));
  MPF_STEP(link_named);
  link->segment_.closeFile();
  link->attachPeer(std::move(server), 0);
  return link;
}

std::unique_ptr<Link> Link::tryOpen(const std::string& backplane, const std::string& name,
                                    const OwnWindow& own) {
  auto segment = Segment::tryOpen(name, layout::SegmentKind::link, Segment::Access::readWrite);
  if (!segment) return nullptr;
  const auto& header = segment->header();
  checkGeometry(header, name);
  const auto& offer = own.header();
  if (name != SegmentName::link(backplane, offer.incarnation, header.incarnation) ||
      header.serverWindow != offer.incarnation || header.maxMessageBytes > offer.maxMessageBytes ||
      header.maxPoolBytes > offer.maxPoolBytes ||
      segment->bytes() != linkBytes(LinkGeometry::forQueue(header.queueSize))) {
    throw SegmentError(segments::path(name) +
                       ": name, server, limits or length differ from what this server offers");
  }
  MPF_STEP(link_mapped);
  segment->closeFile();
  return std::unique_ptr<Link>(
      new Link(std::move(*segment), backplane, LinkSide::server, own.rights()));
}

Link::Link(Segment segment, const std::string& backplane, LinkSide side, Rights rights)
    : segment_(std::move(segment)),
      geometry_(LinkGeometry::forQueue(segment_.header().queueSize)),
      backplane_(backplane),
      side_(side),
      maxMessageBytes_(std::min<std::uint64_t>(segment_.header().maxMessageBytes, UINT32_MAX)),
      outWatch_(wordsOf(segment_, other(side)).watch),
      inWatch_(wordsOf(segment_, side).watch),
      out_(slotsOf(segment_, side), slotCount(segment_, side), wordsOf(segment_, other(side)).ring,
           secondRing(segment_, side), &in_, &wordsOf(segment_, other(side)).polledOn),
      in_(slotsOf(segment_, other(side)), slotCount(segment_, other(side)),
          wordsOf(segment_, side).ring, secondRing(segment_, other(side)),
          &wordsOf(segment_, side).polledOn),
      pool_(poolPlace(segment_, backplane_, side), {rights.mode & 0666, rights.group, rights.user},
            segment_.header().maxPoolBytes, wordsOf(segment_, other(side)).returns),
      borrowed_(poolPlace(segment_, backplane_, other(side)), segment_.header().maxPoolBytes,
                wordsOf(segment_, side).returns),
      fanOut_(backplane_, segment_.header().serverWindow) {}

Link::~Link() {
  if (side_ == LinkSide::client && !forkGuard_.isInherited()) segments::remove(segment_.name());
  // The pool keeps its names only if the client will still remove them. A client that has ended the
  // link may already have done so, before our last segment existed: then we remove the names.
  if (leavesPool_ && peerState() == layout::LinkState::open && peer_->hasOwner())
    pool_.leaveNames();
}

void Link::removeFiles(const std::string& backplane, const std::string& name,
                       std::uint64_t incarnation) {
  segments::remove(name);
  removeBulk(backplane, incarnation);
}

void Link::attachPeer(std::shared_ptr<PeerWindow> peer, std::uint32_t peerIndex) noexcept {
  peer_ = std::move(peer);
  peerIndex_ = peerIndex;
}

void Link::setState(layout::LinkState state) noexcept {
  auto& own = side_ == LinkSide::client ? control().clientState : control().serverState;
  // PAIR(link-state): everything that was prepared is stored before the state.
  own.store(state, std::memory_order_release);
  MPF_STEP(link_state_set);
}

layout::LinkState Link::peerState() const noexcept {
  const auto& peers = side_ == LinkSide::client ? control().serverState : control().clientState;
  // PAIR(link-state): also sees everything that the peer prepared.
  return peers.load(std::memory_order_acquire);
}

bool Link::tryLeavePoolToClient() noexcept {
  if (!pool_.hasSegments()) return true;
  const auto client = peer_->user();
  leavesPool_ = client == ::geteuid() || client == 0;
  return leavesPool_;
}

bool Link::hasPeerEnded() const noexcept {
  return peerState() >= layout::LinkState::closed || peer_->isDead() || !peer_->hasOwner();
}

bool Link::tryAllowMore() noexcept {
  if (maxOutstanding() == geometry_.maxOutstanding) return true;
  if (!segment_.tryReserve()) return false;
  MPF_STEP(second_ring_reserved);
  // PAIR(second-ring): the memory is reserved before the server may use it.
  control().hasMoreReplies.store(1, std::memory_order_release);
  MPF_STEP(second_ring_allowed);
  return true;
}

void Link::notifyPeer() noexcept {
  if (peer_) peer_->notify(peerIndex_);
}

// Inline, and field by field, because a copy of the envelope would wait for the stores to it.
[[gnu::always_inline]] inline bool Link::trySendRef(const Envelope& envelope, std::size_t bodyBytes,
                                                    const layout::ChunkRef& ref,
                                                    std::uint32_t reserve) noexcept {
  const auto marked = [&] {
    return Envelope{.type = envelope.type,
                    .flags = static_cast<std::uint8_t>(envelope.flags | layout::kSlotChunk),
                    .requestId = envelope.requestId,
                    .clientType = envelope.clientType,
                    .clientExtra = envelope.clientExtra,
                    .sentTick = envelope.sentTick,
                    .timeNs = envelope.timeNs};
  };
  // As long as a slot has room for: the ring copies such a body in words.
  const std::array<std::uint32_t, layout::kFirstSlotBodyBytes / 4> body{
      ref.segment, ref.chunk, ref.side, ref.missed, ref.cmd};
  const auto bytes = static_cast<std::uint32_t>(bodyBytes);
  if (!out_.tryPushShort(marked, bytes, std::as_bytes(std::span(body)), reserve)) return false;
  afterPush();
  return true;
}

LinkSend Link::trySendLong(const Envelope& envelope, std::span<const std::byte> body,
                           std::uint32_t waiting, std::uint32_t reserve) noexcept {
  if (body.size() <= layout::kInlineBodyBytes && trySendInSlots(envelope, body, waiting))
    return LinkSend::sent;
  if (!out_.hasFree(1 + reserve)) return LinkSend::full;
  auto own = pool_.tryFind(body.data());
  const auto foreign = own ? std::nullopt : borrowed_.tryFind(body.data());
  const bool inPlace = own || foreign;
  if (!inPlace) {
    const auto chunk = pool_.tryAlloc(body.size());
    if (!chunk) return LinkSend::noMemory;
    std::memcpy(chunk->data, body.data(), body.size());
    MPF_STEP(chunk_filled);
    own = pool_.tryFind(chunk->data);
  }
  if (own) pool_.lend(*own);
  MPF_STEP(chunk_lent);
  const auto place = own ? *own : *foreign;
  const auto side = own ? static_cast<std::uint32_t>(side_) : peerSide();
  std::uint32_t cmd = 0;
  if (side_ == LinkSide::client) std::memcpy(&cmd, body.data() + layout::kCmdOffset, sizeof cmd);
  // hasFree() above has checked that it fits.
  if (!trySendRef(envelope, body.size(), {place.segment, place.chunk, side, 0, cmd}, reserve))
    return LinkSend::full;
  return inPlace ? LinkSend::sentInPlace : LinkSend::sent;
}

bool Link::trySendInSlots(const Envelope& envelope, std::span<const std::byte> body,
                          std::uint32_t waiting) noexcept {
  // Each message that the queue may still accept needs one slot. A message of several slots may use
  // only the slots beyond these.
  const auto queued = static_cast<std::uint32_t>(out_.waitingAtMost());
  const auto queueLeft = waiting > queued + 1 ? waiting - queued - 1 : 0;
  const auto needed = std::max(side_ == LinkSide::server ? slotsOfFirstReplies() : 0, queueLeft);
  auto sized = envelope;
  sized.bodyBytes = static_cast<std::uint32_t>(body.size());
  if (!out_.tryPush(sized, body, needed)) return false;
  afterPush();
  return true;
}

LinkSend Link::trySendFanOut(const Envelope& envelope, const std::shared_ptr<FanOutChunk>& chunk,
                             std::size_t bytes, Limits limits, std::uint32_t maxBorrowed) noexcept {
  auto& loans = pool_.loans();
  const auto id = envelope.requestId;
  const auto result = tryRelayFanOut(envelope, chunk, bytes, limits, maxBorrowed, loans.missed(id));
  if (result == LinkSend::sent) loans.forgetMissed(id);
  else if (result != LinkSend::tooLarge) loans.noteMissed(id);
  return result;
}

LinkSend Link::tryRelayFanOut(const Envelope& envelope, const std::shared_ptr<FanOutChunk>& chunk,
                              std::size_t bytes, Limits limits, std::uint32_t maxBorrowed,
                              std::uint32_t missed) noexcept {
  if (bytes > maxMessageBytes()) return LinkSend::tooLarge;
  auto& loans = pool_.loans();
  pool_.collectReturned();
  if (loans.count() >= maxBorrowed || !pool_.canLend() || !out_.hasFree(1 + limits.reserve))
    return LinkSend::full;
  if (!chunk || !loans.tryLend(chunk)) return LinkSend::noMemory;
  // hasFree() above has checked that it fits.
  const layout::ChunkRef ref{chunk->number(), 0, layout::kFanOutSide, missed};
  return trySendRef(envelope, bytes, ref, limits.reserve) ? LinkSend::sent : LinkSend::full;
}

void Link::endFanOut() noexcept {
  pool_.collectReturned();
  // A client that has ended the link may be alive although its window is gone.
  const bool wasKilled = peer_->isDead() && peerState() != layout::LinkState::closed;
  if (wasKilled) pool_.loans().endAll();
  else pool_.loans().retireAll();
}

void Link::afterFencedPush(std::uint64_t messages) noexcept {
  // PAIR(watch-fence): our message is before the fence, our load of the peer's `Watch` after it.
  doorbell::fence();
  if (!peer_ || outWatch_.load(std::memory_order_relaxed) != layout::Watch::unwatched) return;
  // The receiver must wake up before the ring is full.
  const auto room = side_ == LinkSide::client ? header().queueSize : geometry_.replySlots;
  NoticeBatch::notify(peer_, peerIndex_, messages, room / 2);
}

// Of each kMaxInterval messages to a peer that polls, the first one for which this is called is
// timed; of others, those that the sampler chooses.
std::int64_t Link::timeIfDue(bool isPolled) noexcept {
  constexpr auto kInterval = TimeSampler::kMaxInterval;
  const auto sent = out_.messages();
  if (!(isPolled ? sampler_.isFirst(sent) : sampler_.isDue(sent))) {
    untimedUntil_ = (sent / kInterval + 1) * kInterval;
    return 0;
  }
  const auto nowNs = Clock::nowNs();
  sampler_.note(sent, nowNs);
  return nowNs;
}

void Link::release(const std::byte* data) noexcept {
  if (const auto own = pool_.tryFind(data)) {
    pool_.free(*own);
  } else if (const auto foreign = borrowed_.tryFind(data)) {
    borrowed_.giveBack(*foreign);
  } else if (const auto shared = fanOut_.tryRelease(data)) {
    borrowed_.giveBackFanOut(*shared);
  }
}

std::optional<Chunk> Link::tryBorrowOther(layout::ChunkRef ref) try {
  std::optional<Chunk> chunk;
  if (ref.side == layout::kFanOutSide && side_ == LinkSide::client)
    chunk = fanOut_.tryBorrow({ref.segment, ref.chunk}, ref.missed);
  else if (ref.side == peerSide()) chunk = borrowed_.tryBorrow({ref.segment, ref.chunk});
  if (!chunk && hasPeerEnded()) throw ChunkUnavailable();
  return chunk;
} catch (const std::exception&) {  // ChunkUnavailable from above, no descriptor, or no memory
  if (ref.side == layout::kFanOutSide) borrowed_.giveBackFanOut(ref.segment);
  else borrowed_.giveBack({ref.segment, ref.chunk});
  throw ChunkUnavailable();
}

void Link::letPeerSendUnfenced() noexcept {
  if (!expedited_barrier::tryRegister() || peer_->header().takesBarriers == 0) return;
  isUnfenced_ = true;
  inWatch_.store(layout::Watch::polledUnfenced, std::memory_order_relaxed);
}

Link::Barrier Link::unwatch() noexcept {
  in_.showPolling(false);
  inWatch_.store(layout::Watch::unwatched, std::memory_order_relaxed);
  return std::exchange(isUnfenced_, false) ? Barrier::acrossProcesses : Barrier::fence;
}

void Link::execute(Barrier barrier) noexcept {
  if (barrier == Barrier::acrossProcesses) return expedited_barrier::acrossProcesses();
  // PAIR(watch-fence): our `Watch` is stored before the fence; the caller looks for messages after
  // the fence.
  doorbell::fence();
}

}  // namespace mpf
