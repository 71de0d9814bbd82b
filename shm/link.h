// SPDX-License-Identifier: MIT
// Link: the private segment of one client-server pair, from one side: a ring out, a ring in, a pool
// of our own, the peer's.
//
//   client side ── requests ring, client's pool ──► server side
//               ◄── replies ring, server's pool ──
//
// Threads  one thread receives (hasMessage, begin, copyBody, end). Everything else that is not
//          const is serialised by the caller.
// Crash    the client owns the segment; a server removes it once the client's window is ownerless.
// Trust    the peer may write every byte; geometry was copied and checked at the start, the rest is
//          checked at use.
#pragma once

#include <algorithm>
#include <exception>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "shm/pool.h"
#include "shm/ring.h"
#include "shm/window.h"

namespace mpf {

enum class LinkSide : std::uint32_t { client = 0, server = 1 };

// Whether a message was sent. `sentInPlace`: the chunk that held the body is the peer's now; after
// all others the caller keeps it.
enum class LinkSend { sent, sentInPlace, full, tooLarge, noMemory };

// Memory that a peer lent us went with the peer, or we lack the descriptors or the memory to look
// at it.
class ChunkUnavailable final : public std::exception {};

// Sizes of a link that follow from the length of its queue.
struct LinkGeometry {
  static constexpr std::uint32_t kMaxQueueSize = 16384;
  std::uint32_t queueSlots;
  std::uint32_t replySlots;
  std::uint32_t maxOutstanding;
  static LinkGeometry forQueue(std::uint32_t queueSize) noexcept;
};

class Link {
 public:
  // A new link of ours to `server`, not yet accepted. `index` is its bit in our own window.
  //   throws  std::system_error (no memory, no right), SegmentError (the server's window offers
  //           nonsense)
  static std::unique_ptr<Link> create(const std::string& backplane, const OwnWindow& own,
                                      std::uint32_t index, std::shared_ptr<PeerWindow> server);
  // Rights of a link to `server`: what its processes need to open it.
  [[nodiscard]] static Rights rightsAt(const PeerWindow& server);
  // Maps a link that a client made for us; nullptr when it is gone.
  //   throws  SegmentError, std::system_error: the link is not usable, ignore it
  static std::unique_ptr<Link> tryOpen(const std::string& backplane, const std::string& name,
                                       const OwnWindow& own);
  ~Link();

  [[nodiscard]] LinkSide side() const noexcept { return side_; }
  [[nodiscard]] const layout::SegmentHeader& header() const noexcept { return segment_.header(); }
  [[nodiscard]] layout::LinkControl& control() const noexcept {
    return segment_.at<layout::LinkControl>(layout::kLinkControlOffset);
  }
  [[nodiscard]] const std::string& name() const noexcept { return segment_.name(); }

  [[nodiscard]] const std::shared_ptr<PeerWindow>& peer() const noexcept { return peer_; }
  void attachPeer(std::shared_ptr<PeerWindow> peer, std::uint32_t peerIndex) noexcept;
  void setPeerIndex(std::uint32_t peerIndex) noexcept { peerIndex_ = peerIndex; }

  // Whether somebody cut its file: all that it holds is gone.
  [[nodiscard]] bool isLost() const noexcept { return segment_.isLost(); }
  // Our half of the state, and the peer's as it says.
  void setState(layout::LinkState state) noexcept;
  [[nodiscard]] layout::LinkState peerState() const noexcept;
  // The peer has ended the link, or itself: what it left in the rings may speak of memory that is
  // gone.
  [[nodiscard]] bool hasPeerEnded() const noexcept;
  // For a server that ends: its client finds the memory of what it has yet to take, and removes it.
  // False: that of this user may not.
  [[nodiscard]] bool tryLeavePoolToClient() noexcept;
  // Tells the peer to look at this link, whether it polls it or not.
  void notifyPeer() noexcept;

  // --- sending ---
  // handed on by reference: packed into registers, they would be read before they are stored
  struct Limits {
    // longest queue of messages that the peer has not taken; 0: what the ring holds
    std::uint32_t waiting = 0;
    std::uint32_t reserve = 0;  // slots to leave free
    // slots that a message of several slots leaves free; if it cannot, it goes into a chunk
    std::uint32_t longReserve = 0;
  };
  // Sends a body (its length and flags are added to `envelope`): in line, or as the chunk that it
  // lies in (ours or borrowed; then the chunk is the peer's), or as a copy in a chunk.
  LinkSend trySend(Envelope& envelope, std::span<const std::byte> body,
                   const Limits& limits) noexcept;
  // Whether the next message is one of those that carry their time (Envelope::sentTick).
  [[nodiscard]] bool shouldSampleTime() const noexcept;
  // Number of the last message sent, from 1.
  [[nodiscard]] std::uint64_t sentMessages() const noexcept { return out_.messages(); }
  // Whether the peer has taken message number `ordinal`.
  [[nodiscard]] bool isTaken(std::uint64_t ordinal) noexcept;

  // A chunk to build a body in; nullopt when there is no memory for it.
  std::optional<Chunk> tryAlloc(std::size_t bytes) noexcept;
  // Frees a chunk of ours or gives back a borrowed one; `data` points to its start.
  void release(const std::byte* data) noexcept;

  // --- receiving ---
  [[nodiscard]] bool hasMessage() const noexcept { return in_.hasMessage(); }
  // The same, or the peer has ended the link: one hint may have told of both, and only the first
  // was looked at.
  [[nodiscard]] bool hasNews() const noexcept {
    return hasMessage() || peerState() >= layout::LinkState::closed;
  }
  [[nodiscard]] Envelope begin() noexcept { return in_.begin(); }
  [[nodiscard]] std::size_t inlineCapacity() const noexcept { return in_.inlineCapacity(); }
  void copyBody(std::span<std::byte> body) const noexcept { in_.copyBody(body); }
  // All that the first slot of the message begun may hold.
  void copyFirst(std::span<std::byte, layout::kFirstSlotBodyBytes> body) const noexcept {
    in_.copyFirst(body);
  }
  // The chunk of a kSlotChunk message begun: borrowed, or our own come back. nullopt: nonsense.
  //   throws  ChunkUnavailable: its memory cannot be had, and the chunk has been given back
  std::optional<Chunk> tryChunk(const Envelope& envelope);
  void end() noexcept { in_.end(); }
  [[nodiscard]] std::uint64_t receivedMessages() const noexcept { return in_.messages(); }

  // While not watched, the peer sets our ready bit with each message.
  void setWatched(bool watched) noexcept;

  // Largest body that may be sent: what the peer offers and an envelope can say.
  [[nodiscard]] std::uint64_t maxMessageBytes() const noexcept {
    return std::min<std::uint64_t>(segment_.header().maxMessageBytes, UINT32_MAX);
  }

 private:
  Link(Segment segment, const std::string& backplane, LinkSide side, Rights rights);
  void afterPush() noexcept;
  std::optional<Chunk> tryBorrow(const layout::ChunkRef& ref);

  ForkGuard forkGuard_;
  Segment segment_;
  std::string backplane_;
  LinkSide side_;
  std::shared_ptr<PeerWindow> peer_;
  std::uint32_t peerIndex_ = 0;
  const layout::RingControl& outControl_;
  RingProducer out_;
  RingConsumer in_;
  PoolOwner pool_;
  bool leavesPool_ = false;
  PoolBorrower borrowed_;
};

}  // namespace mpf
