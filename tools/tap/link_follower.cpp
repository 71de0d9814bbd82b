// SPDX-License-Identifier: MIT
#include "tools/tap/link_follower.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <iterator>

namespace mpf::tools {
namespace {

// The largest number of messages that is read of one direction before the other one is read.
constexpr std::size_t kBatch = 256;

const layout::LinkControl& controlOf(const Segment& segment) {
  return segment.at<layout::LinkControl>(layout::kLinkControlOffset);
}

// Merges both directions so that the request of a reply, and the requests before it, precede it.
void interleave(std::vector<TappedMessage>& requests, std::vector<TappedMessage>& replies,
                std::vector<TappedMessage>& merged) {
  auto next = requests.begin();
  for (auto& reply : replies) {
    const auto own = std::find_if(next, requests.end(), [&](const TappedMessage& request) {
      return request.requestId == reply.requestId;
    });
    if (own != requests.end()) {
      std::move(next, own + 1, std::back_inserter(merged));
      next = own + 1;
    }
    merged.push_back(std::move(reply));
  }
  std::move(next, requests.end(), std::back_inserter(merged));
}

}  // namespace

std::unique_ptr<LinkFollower> LinkFollower::tryOpen(const std::string& backplane,
                                                    const std::string& name, FollowFrom from) {
  auto segment = Segment::tryOpen(name, layout::SegmentKind::link, Segment::Access::readOnly);
  if (!segment) return nullptr;
  const auto& header = segment->header();
  const auto isRing = [](std::uint32_t slots) {
    return std::has_single_bit(slots) && slots >= 16 && slots <= layout::kMaxRingSlots;
  };
  if (!isRing(header.queueSlots) || !isRing(header.replySlots) ||
      (header.moreReplySlots != 0 && !isRing(header.moreReplySlots)) ||
      segment->bytes() <
          layout::linkBytes(header.queueSlots, header.replySlots, header.moreReplySlots)) {
    throw SegmentError(segments::path(name) + ": not a link: its rings do not fit its file");
  }
  return std::unique_ptr<LinkFollower>(new LinkFollower(backplane, std::move(*segment), from));
}

LinkFollower::LinkFollower(const std::string& backplane, Segment segment, FollowFrom from)
    : segment_(std::move(segment)),
      bulk_(backplane, segment_.header().incarnation, segment_.header().serverWindow),
      requests_(begin(Direction::request, from)),
      replies_(begin(Direction::reply, from)) {}

LinkFollower::Side LinkFollower::begin(Direction direction, FollowFrom from) const {
  constexpr int kTries = 100;
  const auto& control = controlOf(segment_);
  const bool isRequest = direction == Direction::request;
  const auto* slots = &segment_.at<layout::Slot>(layout::kLinkRingsOffset);
  const auto* replies = slots + header().queueSlots;
  const auto makeFollower = [&] {
    return isRequest ? RingFollower({slots, header().queueSlots}, {}, from)
                     : RingFollower({replies, header().replySlots},
                                    {replies + header().replySlots, header().moreReplySlots}, from);
  };
  Side side{makeFollower(), isRequest ? control.clientSent : control.serverSent,
            isRequest ? control.requests : control.replies};
  if (from == FollowFrom::first) return side;
  // The counter and the position of the follower must belong together. If messages keep arriving,
  // they agree only approximately.
  for (int tries = 1; tries <= kTries && side.sent() != side.sentBefore; ++tries) {
    side.sentBefore = side.sent();
    side.follower = makeFollower();
  }
  return side;
}

// The producer counts a message after it has published it, so the consumer may count it first.
std::uint64_t LinkFollower::Side::sent() const noexcept {
  return std::max(counter.load(std::memory_order_relaxed),
                  consumer.taken.load(std::memory_order_relaxed));
}

void LinkFollower::Side::noteSent(std::uint64_t counted) noexcept {
  // Without an overrun none was missed: one that is counted only now was sent before the follower
  // began.
  if (!wasOverrun) sentBefore = std::max(sentBefore, counted - std::min(counted, seen));
  const auto since = counted - std::min(counted, sentBefore);
  missed = since - std::min(since, seen);
}

bool LinkFollower::take(std::vector<TappedMessage>& messages) {
  newRequests_.clear();
  newReplies_.clear();
  // Replies first: the request of each reply that is read now is in the other ring by then.
  const bool some = drain(replies_, Direction::reply, newReplies_);
  const bool more = drain(requests_, Direction::request, newRequests_);
  interleave(newRequests_, newReplies_, messages);
  return some || more;
}

bool LinkFollower::drain(Side& side, Direction direction, std::vector<TappedMessage>& messages) {
  RingCopy copy;
  bool some = false;
  while (messages.size() < kBatch) {
    const auto counted = side.sent();
    const auto next = side.follower.tryNext(copy);
    some = some || next != RingFollower::Next::nothing;
    side.wasOverrun = side.wasOverrun || next == RingFollower::Next::overrun;
    if (next == RingFollower::Next::nothing) side.noteSent(counted);
    if (next != RingFollower::Next::message) break;
    ++side.seen;
    messages.push_back(read(copy, side, direction));
  }
  return some;
}

TappedMessage LinkFollower::read(const RingCopy& copy, const Side& side, Direction direction) {
  TappedMessage tapped;
  tapped.direction = direction;
  tapped.requestId = copy.envelope.requestId;
  tapped.isFirstReply = (copy.envelope.flags & layout::kSlotFirstReply) != 0;
  try {
    readBody(copy, side, tapped);
  } catch (const std::exception& error) {
    tapped.problem = error.what();
  }
  return tapped;
}

void LinkFollower::readBody(const RingCopy& copy, const Side& side, TappedMessage& tapped) {
  const auto type = static_cast<MessageType>(copy.envelope.type);
  if ((copy.envelope.flags & layout::kSlotChunk) == 0) {
    tapped.message = Message::copyOf(type, copy.body());
  } else {
    layout::ChunkRef ref{};
    std::memcpy(&ref, copy.bytes.data(), sizeof ref);
    tapped.message = Message::copyOf(type, bulk_.read(ref, copy.envelope.bodyBytes));
    // PAIR(message-taken): the body is read first, and then whether the receiver had taken it.
    tapped.mayHaveChanged = side.consumer.taken.load(std::memory_order_acquire) >=
                            side.sentBefore + side.seen + side.missed;
  }
  tapped.message.setClientType(copy.envelope.clientType);
  tapped.message.setClientExtra(copy.envelope.clientExtra);
  if (tapped.direction == Direction::reply) tapped.message.setTimeStampNs(copy.envelope.timeNs);
}

bool LinkFollower::isOver() const {
  const auto& control = controlOf(segment_);
  const auto ended = [](const std::atomic<layout::LinkState>& state) {
    const auto is = state.load(std::memory_order_relaxed);
    return is == layout::LinkState::closed || is == layout::LinkState::refused;
  };
  return ended(control.clientState) || ended(control.serverState);
}

}  // namespace mpf::tools
