// SPDX-License-Identifier: MIT
// SendQueue: the items that wait to be sent over one connection, and the frames built from them.
//
//   push() ─► queue ─► buildFrame(): as many items as fit ─► the caller writes it ─► frameWritten()
//
// While a frame is being written, items for the next one gather in the queue. A waiting message
// stays in the shared memory of its sender, and is converted when its frame is built.
//
// Threads  one.
#pragma once

#include <capnp/message.h>
#include <deque>
#include <functional>
#include <kj/array.h>
#include <kj/memory.h>
#include <string>
#include <variant>
#include <vector>

#include "router/statistics.h"
#include "router/transport/carried.h"
#include "schema/router.capnp.h"

namespace mpf::router {

class SendQueue {
 public:
  // Fills in an item that is not a message, when its frame is built.
  using Note = std::function<void(wire::Item::Builder)>;
  enum class NoteKind {
    own,  // begun by this side
    answer,  // to an item of the peer
  };
  // A message cannot be sent, for the reason `why`. `instead` is sent in its place; it is empty
  // unless this function fills it.
  using OnUnsendable = std::function<void(const Carried& carried, const std::string& why,
                                          wire::Item::Builder instead)>;
  struct FrameLimits {
    std::size_t items = SIZE_MAX;
    std::size_t bytes = 0;  // a single item may be longer
    std::uint64_t messageBytes = 0;  // longer messages are unsendable
  };
  static constexpr std::size_t kMaxNotes = 4096;

  //   queueSize  messages that may wait
  SendQueue(std::uint32_t queueSize, PeerRecord& record);

  // Append an item, also when hasRoom() is false.
  void push(Note note, NoteKind kind);
  void push(Carried carried);
  // Does not send a message. If it is a request, takeUnsentRequests() returns it.
  void reject(Carried carried);

  [[nodiscard]] bool hasRoom() const noexcept {
    return messages_ < queueSize_ && queue_.size() - messages_ < kMaxNotes;
  }
  // Whether so many answers wait that no more items of the peer should be handled.
  [[nodiscard]] bool hasMaxAnswers() const noexcept { return answers_ >= kMaxNotes; }
  [[nodiscard]] bool isEmpty() const noexcept { return queue_.empty(); }
  // Whether no item waits and no frame is being written.
  [[nodiscard]] bool isIdle() const noexcept { return isEmpty() && frame_.get() == nullptr; }

  // Moves at least one item, and as many as the limits allow, into a frame. The frame is valid
  // until frameWritten(). The queue must not be empty.
  [[nodiscard]] capnp::MessageBuilder& buildFrame(const FrameLimits& limits,
                                                  const OnUnsendable& onUnsendable);
  void frameWritten() { frame_ = nullptr; }

  // Empties the queue, and returns its requests and those that were rejected.
  [[nodiscard]] std::vector<Carried> takeUnsentRequests();

 private:
  struct KindedNote {
    NoteKind kind;
    Note fill;
  };
  using Outgoing = std::variant<KindedNote, Carried>;
  struct FrameSize {
    std::size_t items;
    std::size_t bytes;  // an estimate
  };
  [[nodiscard]] FrameSize sizeOfNextFrame(const FrameLimits& limits) const;
  void makeScratch(std::size_t bytes);
  void countWaiting() noexcept;

  std::uint32_t queueSize_;
  PeerRecord& record_;
  std::deque<Outgoing> queue_;
  std::size_t messages_ = 0;  // in queue_
  std::size_t answers_ = 0;  // in queue_
  std::vector<Carried> rejectedRequests_;
  kj::Array<capnp::word> scratch_;  // memory for frames, kept from frame to frame
  kj::Own<capnp::MallocMessageBuilder> frame_;
};

}  // namespace mpf::router
