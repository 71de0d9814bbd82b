// SPDX-License-Identifier: MIT
// SendQueue: the items that wait to be sent over one connection, and the frames built from them.
//
//   push() ─► queue ─► buildFrames(): as many items as fit ─► part(), partWritten() ─► framesWritten()
//                                                             ▲      │
//                                                             └──────┘ the caller writes the part
//
// While frames are being written, items for the next ones gather in the queue. Plain items are
// converted at once, and follow each other in a PlainRun, which becomes a frame of its own. Any
// other message that waits stays in the shared memory of its sender, and is converted when its
// frame is built.
//
// Threads  one.
#pragma once

#include <capnp/message.h>
#include <deque>
#include <functional>
#include <kj/array.h>
#include <kj/memory.h>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "router/statistics.h"
#include "router/transport/carried.h"
#include "router/transport/plain_item.h"
#include "schema/router.capnp.h"

namespace mpf::router {

class SendQueue {
 public:
  // Fills in an item that is not a message, when its frame is built.
  using FillItem = std::function<void(wire::Item::Builder)>;
  enum class Origin {
    own,  // begun by this side
    answer,  // to an item of the peer
  };
  // A message cannot be sent, for the reason `why`. `instead` is sent in its place; it is empty
  // unless this function fills it.
  using OnUnsendable = std::function<void(const Carried& carried, const std::string& why,
                                          wire::Item::Builder instead)>;
  struct FrameLimits {
    std::size_t items = SIZE_MAX;  // if there are no plain items
    std::size_t bytes = 0;  // a single item, or the last frame of several, may be longer
    std::uint64_t messageBytes = 0;  // longer messages are unsendable
  };
  static constexpr std::size_t kMaxControlItems = 4096;
  static constexpr std::size_t kPartBytes = std::size_t{1} << 20;

  //   queueSize  messages that may wait
  SendQueue(std::uint32_t queueSize, PeerRecord& record);

  // Append an item, also when hasRoom() is false.
  void push(FillItem fill, Origin origin);
  void push(Carried carried);
  void push(const PlainOutgoing& item);
  void push(const PlainItems& items);
  // Does not send a message. If it is a request, takeUnsentRequests() returns it.
  void reject(Carried carried);
  void reject(const PlainOutgoing& item);

  // For how many messages there is room.
  [[nodiscard]] std::size_t room() const noexcept {
    return messages_ < queueSize_ && controlItems_ < kMaxControlItems ? queueSize_ - messages_ : 0;
  }
  [[nodiscard]] bool hasRoom() const noexcept { return room() != 0; }
  // Whether so many answers wait that no more items of the peer should be handled.
  [[nodiscard]] bool hasMaxAnswers() const noexcept { return answers_ >= kMaxControlItems; }
  [[nodiscard]] bool isEmpty() const noexcept { return queue_.empty(); }
  // Whether frames were built that framesWritten() has not ended.
  [[nodiscard]] bool isBeingWritten() const noexcept { return !pieces_.empty(); }

  // Moves at least one item, and as many as the limits allow, into frames. The queue must not be
  // empty.
  void buildFrames(const FrameLimits& limits, const OnUnsendable& onUnsendable);
  // Returns the next kPartBytes of the frames, or what is left, in pieces that are valid until the
  // next call; nothing when all bytes have been written.
  using Pieces = kj::ArrayPtr<const kj::ArrayPtr<const kj::byte>>;
  [[nodiscard]] Pieces part();
  // The first `bytes` of part() have been written.
  void partWritten(std::size_t bytes) noexcept;
  void framesWritten();

  // Empties the queue, and returns its requests and those that were rejected. Those that were plain
  // have no message any more.
  [[nodiscard]] std::vector<Carried> takeUnsentRequests();

 private:
  struct ControlItem {
    Origin origin;
    FillItem fill;
  };
  using Run = std::unique_ptr<PlainRun>;
  using Outgoing = std::variant<ControlItem, Carried, Run>;
  struct FrameSize {
    std::size_t items;
    std::size_t bytes;  // an estimate
  };
  [[nodiscard]] FrameSize sizeOfNextFrame(const FrameLimits& limits) const;
  std::size_t buildPlainFrame();
  std::size_t buildOtherFrame(const FrameLimits& limits, const OnUnsendable& onUnsendable);
  void addPieces(capnp::MallocMessageBuilder& frame);
  [[nodiscard]] PlainRun& runWithRoom();
  [[nodiscard]] Run takeSpareRun();
  void makeScratch(std::size_t bytes);
  void countWaiting() noexcept;

  std::uint32_t queueSize_;
  PeerRecord& record_;
  std::deque<Outgoing> queue_;
  std::size_t messages_ = 0;  // in queue_
  std::size_t controlItems_ = 0;  // in queue_
  std::size_t answers_ = 0;  // of these, answers
  std::vector<Carried> rejectedRequests_;
  kj::Array<capnp::word> scratch_;  // memory for frames, kept from frame to frame
  // What is being written: at most one frame of other items.
  kj::Own<capnp::MallocMessageBuilder> frame_;
  std::vector<std::uint32_t> table_;  // its segment table
  std::vector<Run> runs_;
  std::vector<kj::ArrayPtr<const kj::byte>> pieces_;
  std::size_t nextPiece_ = 0;  // the first one that is not written completely
  std::vector<kj::ArrayPtr<const kj::byte>> part_;
  std::vector<Run> spareRuns_;
};

}  // namespace mpf::router
