// SPDX-License-Identifier: MIT
// Link: one side of the segment that one client and one server share: an outgoing ring, an incoming
// ring, our own pool and the peer's pool.
//
//   client side ── requests ring, client's pool ──► server side
//               ◄── replies ring, server's pool ──
//
// Threads  one thread receives, with incoming(), and may call expectSend(). The caller serialises
//          all other non-const functions, those of outgoing() included.
// Crash    the client owns the segment. If the owner of the client's window dies, the server
//          removes the segment.
// Trust    the peer may write every byte. The geometry is copied and checked when the link is
//          opened; every other value is checked when it is used.
#pragma once

#include <algorithm>
#include <exception>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "base/expedited_barrier.h"
#include "base/step.h"
#include "shm/fan_out_borrower.h"
#include "shm/fan_out_pool.h"
#include "shm/pool.h"
#include "shm/ring.h"
#include "shm/time_sampler.h"
#include "shm/window.h"

namespace mpf {

enum class LinkSide : std::uint32_t { client = 0, server = 1 };

// The result of a send. After `sentInPlace` the peer owns the chunk that contains the body; after
// all other results the caller still owns it.
enum class LinkSend { sent, sentInPlace, full, tooLarge, noMemory };

// A chunk cannot be read: its peer has ended and removed it, or this process has no free descriptor
// or memory to map it.
class ChunkUnavailable final : public std::exception {};

// Sizes of a link that follow from the length of its queue.
struct LinkGeometry {
  static constexpr std::uint32_t kMaxQueueSize = 16384;
  std::uint32_t queueSlots;
  std::uint32_t replySlots;
  std::uint32_t moreReplySlots;  // 0: the first reply ring is large enough
  std::uint32_t maxOutstanding;
  // Requests that may be unanswered while the second reply ring has no memory.
  std::uint32_t firstOutstanding;
  [[nodiscard]] std::uint32_t allReplySlots() const noexcept { return replySlots + moreReplySlots; }
  static LinkGeometry forQueue(std::uint32_t queueSize) noexcept;
};

// Base of the object that handles the messages of a link. All links of one endpoint have users of
// one type, to which the owner of the endpoint casts.
class LinkUser {
 protected:
  ~LinkUser() = default;
};

class Link {
 public:
  // Creates a link from our window to `server`, which has not accepted it yet. `index` is the
  // link's bit in our own window.
  //   throws  std::system_error (no memory, no permission), SegmentError (the server's window
  //           contains invalid data)
  static std::unique_ptr<Link> create(const std::string& backplane, const OwnWindow& own,
                                      std::uint32_t index, std::shared_ptr<PeerWindow> server);
  // The rights that the server's process needs to open a link to `server`.
  [[nodiscard]] static Rights rightsAt(const PeerWindow& server);
  // Maps a link that a client created to our window; nullptr if it no longer exists.
  //   throws  SegmentError, std::system_error: the link is unusable; the caller ignores it
  static std::unique_ptr<Link> tryOpen(const std::string& backplane, const std::string& name,
                                       const OwnWindow& own);
  // Removes the files of a link and its pools, for a peer whose client has died.
  static void removeFiles(const std::string& backplane, const std::string& name,
                          std::uint64_t incarnation);
  ~Link();

  [[nodiscard]] LinkSide side() const noexcept { return side_; }
  [[nodiscard]] const layout::SegmentHeader& header() const noexcept { return segment_.header(); }
  [[nodiscard]] const LinkGeometry& geometry() const noexcept { return geometry_; }
  [[nodiscard]] layout::LinkControl& control() const noexcept {
    return segment_.at<layout::LinkControl>(layout::kLinkControlOffset);
  }
  [[nodiscard]] const std::string& name() const noexcept { return segment_.name(); }
  // Whether this process is a forked child of the one that made the link.
  [[nodiscard]] bool isInherited() const noexcept { return forkGuard_.isInherited(); }

  [[nodiscard]] const std::shared_ptr<PeerWindow>& peer() const noexcept { return peer_; }
  void attachPeer(std::shared_ptr<PeerWindow> peer, std::uint32_t peerIndex) noexcept;
  void setPeerIndex(std::uint32_t peerIndex) noexcept { peerIndex_ = peerIndex; }
  // The client's side, when the server has accepted the link.
  void usePeerIndexOfServer() noexcept {
    setPeerIndex(control().serverIndex.load(std::memory_order_relaxed) % layout::kMaxLinks);
  }

  // The user of this side: Endpoint::attach() sets it.
  void setUser(LinkUser& user) noexcept { user_ = &user; }
  [[nodiscard]] LinkUser& user() const noexcept { return *user_; }

  // Whether the file of the link was truncated: its contents are lost.
  [[nodiscard]] bool isLost() const noexcept { return segment_.isLost(); }
  // Sets our half of the link's state; reads the peer's half.
  void setState(layout::LinkState state) noexcept;
  [[nodiscard]] layout::LinkState peerState() const noexcept;
  // Whether the peer has ended the link or has exited. Messages that it left in the rings may refer
  // to chunks that no longer exist.
  [[nodiscard]] bool hasPeerEnded() const noexcept;
  // For a server that exits: keeps the names of its pool, so that the client can read the replies
  // that it has not taken yet. The client removes the names. Returns false if the client's user has
  // no right to remove them.
  [[nodiscard]] bool tryLeavePoolToClient() noexcept;
  // Requests that may be unanswered now.
  [[nodiscard]] std::uint32_t maxOutstanding() const noexcept {
    // PAIR(second-ring): the client has reserved the memory.
    return control().hasMoreReplies.load(std::memory_order_acquire) == 0
               ? geometry_.firstOutstanding
               : geometry_.maxOutstanding;
  }
  // At the server: slots to leave free for first replies in the ring that is in use. In the first
  // ring, these are the requests that may be unanswered while the second one has no memory. When it
  // has memory, the server can move there, and the second ring begins empty.
  [[nodiscard]] std::uint32_t slotsOfFirstReplies() const noexcept {
    return out_.canMove() ? geometry_.firstOutstanding : geometry_.maxOutstanding;
  }
  // At the client: lets geometry().maxOutstanding requests be unanswered. Returns false if there is
  // no memory for their replies.
  [[nodiscard]] bool tryAllowMore() noexcept;
  // Notifies the peer that it must look at this link, even if it polls the link.
  void notifyPeer() noexcept;

  // --- sending ---
  struct Limits {
    // highest number of messages that the peer has not taken; 0: as many as fit into the ring
    std::uint32_t waiting = 0;
    // slots to leave free; a reply of several slots leaves as many free as there may be first
    // replies, or its body goes into a chunk
    std::uint32_t reserve = 0;
  };
  // Sends a body; sets its length and flags in the envelope that `envelope()` returns. A short body
  // is copied into slots of the ring. If a longer body is in a chunk already (our own or a borrowed
  // one), the peer gets this chunk; otherwise the body is copied into a new chunk.
  template <class MakeEnvelope>
  [[gnu::always_inline]] LinkSend trySend(const MakeEnvelope& envelope,
                                          std::span<const std::byte> body, Limits limits) noexcept {
    if (body.size() > maxMessageBytes_) return LinkSend::tooLarge;
    if (limits.waiting != 0 && out_.waitingAtMost() >= limits.waiting &&
        out_.waiting() >= limits.waiting)
      return LinkSend::full;
    if (body.size() > layout::kFirstSlotBodyBytes)
      return trySendLong(envelope(), body, limits.waiting, limits.reserve);
    const auto bytes = static_cast<std::uint32_t>(body.size());
    if (!out_.tryPushShort(envelope, bytes, body, limits.reserve)) return LinkSend::full;
    afterPush();
    return LinkSend::sent;
  }
  // The envelope stays where it is: a copy would wait for the stores to it.
  LinkSend trySend(const Envelope& envelope, std::span<const std::byte> body,
                   Limits limits) noexcept {
    // NOLINTNEXTLINE(bugprone-return-const-ref-from-parameter): used only during the call
    return trySend([&]() -> const Envelope& { return envelope; }, body, limits);
  }
  // Sends messages whose bodies fill a slot each and lie one after the other.
  // `words(index, sentNs)` returns the envelope of each; `sentNs` is as of timeOfNext(), and 0 for
  // all but the first. Returns how many were sent, perhaps fewer than fit; 0: the ring is full, or
  // as many wait as may.
  template <class MakeWords>
  std::size_t trySendRun(const MakeWords& words, std::span<const std::byte> bodies,
                         Limits limits) noexcept {
    const auto wanted = bodies.size() / layout::kFirstSlotBodyBytes;
    const auto most = limits.waiting == 0 ? wanted : roomFor(wanted, limits.waiting);
    const auto firstNs = timeOfNext();
    const auto count =
        out_.pushRun([&](std::size_t index) { return words(index, index == 0 ? firstNs : 0); },
                     bodies.data(), most, limits.reserve);
    if (count != 0) afterPush(count);
    return count;
  }
  // While it exists, messages are sent without a notice to the peer; at its end, one notice stands
  // for all of them.
  class Batch {
   public:
    explicit Batch(Link& link) noexcept : link_(link), sentBefore_(link.out_.messages()) {
      link_.isInBatch_ = true;
    }
    ~Batch() {
      link_.isInBatch_ = false;
      if (const auto sent = link_.out_.messages() - sentBefore_; sent != 0) link_.afterPush(sent);
    }
    Batch(const Batch&) = delete;
    Batch& operator=(const Batch&) = delete;

   private:
    Link& link_;
    const std::uint64_t sentBefore_;
  };
  // At the server: sends a body of `bytes` bytes that lies in a chunk of the fan-out pool. Returns
  // `full` if the client holds `maxBorrowed` chunks of this pool, and `noMemory` if `chunk` is
  // null; then the message counts as missed by its request.
  LinkSend trySendFanOut(const Envelope& envelope, const std::shared_ptr<FanOutChunk>& chunk,
                         std::size_t bytes, Limits limits, std::uint32_t maxBorrowed) noexcept;
  // As trySendFanOut(), for a message of another server: the client is told that `missed` messages
  // of the request were dropped. Does not count a message that is not sent.
  LinkSend tryRelayFanOut(const Envelope& envelope, const std::shared_ptr<FanOutChunk>& chunk,
                          std::size_t bytes, Limits limits, std::uint32_t maxBorrowed,
                          std::uint32_t missed) noexcept;
  // At the server: takes what the client has returned of both pools.
  void collectReturned() noexcept { pool_.collectReturned(); }
  // At the server: the client reads no chunk any more if it was killed; otherwise it may.
  void endFanOut() noexcept;
  // At the server: the number of chunks of the fan-out pool that the client holds.
  [[nodiscard]] std::uint32_t borrowedFanOut() noexcept { return pool_.loans().count(); }
  // The time now if the next message is to be timed (Envelope::sentTick), otherwise 0. For each
  // attempt to send.
  [[nodiscard]] std::int64_t timeOfNext() noexcept {
    const bool isPolled = outWatch_.load(std::memory_order_relaxed) != layout::Watch::unwatched;
    return isPolled && out_.messages() < untimedUntil_ ? 0 : timeIfDue(isPolled);
  }
  // The ring that trySend() fills; it counts the messages that were sent, and those that the peer
  // has taken.
  [[nodiscard]] RingProducer& outgoing() noexcept { return out_; }

  // Allocates a chunk for a body; nullopt if there is no memory for it.
  std::optional<Chunk> tryAlloc(std::size_t bytes) noexcept { return pool_.tryAlloc(bytes); }
  // Whether the limits of the link permit to send a body of this size, once there is room for it.
  [[nodiscard]] bool maySend(std::size_t bytes) const noexcept {
    return bytes <= maxMessageBytes_ &&
           (bytes <= layout::kInlineBodyBytes || pool_.isWithinLimit(bytes));
  }
  // Frees one of our chunks or returns a borrowed one; `data` points to the start of the chunk.
  void release(const std::byte* data) noexcept;

  // Fetches the lines that the next message needs, while the caller prepares it. The receiving
  // thread.
  void expectSend() const noexcept {
    out_.expectPush();
    if (peer_ && outWatch_.load(std::memory_order_relaxed) == layout::Watch::unwatched)
      peer_->expectNotify(peerIndex_);
  }

  // --- receiving ---
  // The ring from which messages are taken.
  [[nodiscard]] RingConsumer& incoming() noexcept { return in_; }
  // Whether there is a message or the peer has ended the link. One hint may stand for both, and the
  // owner may have handled only the message.
  [[nodiscard]] bool hasEvents() noexcept {
    return in_.hasMessage() || peerState() >= layout::LinkState::closed;
  }
  // The chunk of the kSlotChunk message begun, whose number of slots is valid: borrowed from the
  // peer, or one of ours that the peer returns in a message. nullopt if the reference is invalid.
  //   throws  ChunkUnavailable: the chunk cannot be mapped; it has been returned to the peer
  [[gnu::always_inline]] std::optional<Chunk> tryChunk(std::uint32_t bodyBytes) {
    const auto ref = in_.chunkRef();
    const bool isOurs = ref.side == static_cast<std::uint32_t>(side_);
    auto chunk = isOurs ? pool_.tryReceiveBack({ref.segment, ref.chunk}) : tryBorrow(ref);
    if (chunk && bodyBytes > chunk->capacity) chunk.reset();
    return chunk;
  }

  // Announces that we poll this link: the peer need not set our ready bit. `pollsInWaits`: also
  // while we wait; then the peer is told on which processor.
  void watch(bool pollsInWaits) noexcept {
    inWatch_.store(layout::Watch::polled, std::memory_order_relaxed);
    in_.showPolling(pollsInWaits);
  }
  // For a link that we poll and that is busy: lets the peer send without a fence, if barriers reach
  // the peer.
  void letPeerSendUnfenced() noexcept;
  // Announces that we do not poll this link: the peer sets our ready bit with each message. The
  // caller executes the barrier that is returned, for several links the stronger one, and then
  // looks for messages.
  enum class Barrier { fence, acrossProcesses };
  [[nodiscard]] Barrier unwatch() noexcept;
  static void execute(Barrier barrier) noexcept;

  // Largest body that may be sent: the limit of the link, or the largest length that an envelope
  // can represent, if that is smaller.
  [[nodiscard]] std::uint64_t maxMessageBytes() const noexcept { return maxMessageBytes_; }

 private:
  Link(Segment segment, const std::string& backplane, LinkSide side, Rights rights);
  // How many of `wanted` messages may be sent if at most `limit` may wait.
  [[nodiscard]] std::size_t roomFor(std::size_t wanted, std::uint32_t limit) noexcept {
    const auto room = [limit](std::uint64_t waiting) {
      return limit - std::min<std::uint64_t>(waiting, limit);
    };
    if (const auto known = room(out_.waitingAtMost()); known >= wanted) return wanted;
    return std::min<std::size_t>(wanted, room(out_.waiting()));
  }
  // For a body that does not fit into the first slot. The limits come one by one: a copy of both at
  // once would wait for their stores.
  LinkSend trySendLong(const Envelope& envelope, std::span<const std::byte> body,
                       std::uint32_t waiting, std::uint32_t reserve) noexcept;
  // Whether the body was sent in slots of the ring.
  bool trySendInSlots(const Envelope& envelope, std::span<const std::byte> body,
                      std::uint32_t waiting) noexcept;
  // Sends a body that is in a chunk; false if the ring is full.
  bool trySendRef(const Envelope& envelope, std::size_t bodyBytes, const layout::ChunkRef& ref,
                  std::uint32_t reserve) noexcept;
  [[gnu::always_inline]] void afterPush(std::uint64_t messages = 1) noexcept {
    if (isInBatch_) return;
    MPF_STEP(peer_checked);
    expedited_barrier::frequentSide();
    if (outWatch_.load(std::memory_order_relaxed) != layout::Watch::polledUnfenced)
      afterFencedPush(messages);
  }
  void afterFencedPush(std::uint64_t messages) noexcept;
  std::int64_t timeIfDue(bool isPolled) noexcept;
  [[gnu::always_inline]] std::optional<Chunk> tryBorrow(const layout::ChunkRef& ref) {
    if (ref.side == peerSide()) {
      if (const auto chunk = borrowed_.tryBorrowMapped({ref.segment, ref.chunk})) [[likely]]
        return chunk;
    }
    return tryBorrowOther(ref);
  }
  // tryBorrow() of a chunk that is not mapped yet, is in the fan-out pool, or does not exist. `ref`
  // is a copy, so that the caller's stays in registers.
  std::optional<Chunk> tryBorrowOther(layout::ChunkRef ref);
  [[nodiscard]] std::uint32_t peerSide() const noexcept {
    return 1 - static_cast<std::uint32_t>(side_);
  }

  ForkGuard forkGuard_;
  Segment segment_;
  LinkGeometry geometry_;
  std::string backplane_;
  LinkSide side_;
  LinkUser* user_ = nullptr;
  std::shared_ptr<PeerWindow> peer_;
  std::uint32_t peerIndex_ = 0;
  std::uint64_t maxMessageBytes_;
  const std::atomic<layout::Watch>& outWatch_;  // the peer's
  std::atomic<layout::Watch>& inWatch_;
  bool isUnfenced_ = false;  // the peer may send without a fence
  bool isInBatch_ = false;  // the end of the batch notifies the peer
  RingProducer out_;
  TimeSampler sampler_;  // of outgoing messages
  std::uint64_t untimedUntil_ = 0;  // no message to a peer that polls is timed before this number
  RingConsumer in_;
  PoolOwner pool_;
  bool leavesPool_ = false;
  PoolBorrower borrowed_;
  FanOutBorrower fanOut_;  // at the client
};

}  // namespace mpf
