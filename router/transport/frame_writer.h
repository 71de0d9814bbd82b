// SPDX-License-Identifier: MIT
// FrameWriter: writes the frames of a SendQueue to a stream, soon after the first item is pushed
// (DueWrites). Plain TCP is written at once as far as the kernel takes it (DirectIo). TLS, what the
// kernel has no room for, and what follows the first MiB of a frame, are written by tasks of the
// event loop.
//
// Threads  that of the event loop.
#pragma once

#include <kj/async-io.h>
#include <utility>

#include "router/due_writes.h"
#include "router/transport/direct_io.h"
#include "router/transport/send_queue.h"

namespace mpf::router {

class FrameWriter final : public DueWriter {
 public:
  // None of these functions may destroy the writer.
  class Owner {
   public:
    // Frames are built and written now. Returns their limits.
    virtual SendQueue::FrameLimits onFrames() = 0;
    // A part of them was written by a task.
    virtual void onPart() = 0;
    virtual void onWritten() = 0;
    // No item waits any longer.
    virtual void onIdle() = 0;
    // The stream has failed: nothing more is written.
    virtual void onWriteFailure(const kj::Exception& error) = 0;

   protected:
    ~Owner() = default;
  };

  // What the references refer to outlives this object. `direct` belongs to the stream.
  FrameWriter(Owner& owner, kj::AsyncIoStream& stream, DirectIo direct, DueWrites& writes,
              SendQueue queue, SendQueue::OnUnsendable onUnsendable);
  ~FrameWriter() { writes_.remove(*this); }
  FrameWriter(const FrameWriter&) = delete;
  FrameWriter& operator=(const FrameWriter&) = delete;

  // Appends an item to the queue, and starts a write if none is in progress.
  template <class... Outgoing>
  void push(Outgoing&&... outgoing) {
    queue_.push(std::forward<Outgoing>(outgoing)...);
    if (!std::exchange(isBusy_, true)) writes_.add(*this);
  }
  // For everything but push(). Do not empty the queue while a write is due or in progress.
  [[nodiscard]] SendQueue& queue() noexcept { return queue_; }
  [[nodiscard]] const SendQueue& queue() const noexcept { return queue_; }

  void writeDue() noexcept override;

 private:
  void writeFrames();
  void buildFrames() { queue_.buildFrames(owner_.onFrames(), onUnsendable_); }
  std::size_t writePart();
  kj::Promise<void> writeAll();
  kj::Promise<void> writeParts();
  void framesWritten();
  void becomeIdle();

  Owner& owner_;
  kj::AsyncIoStream& stream_;
  DirectIo direct_;
  DueWrites& writes_;
  SendQueue queue_;
  SendQueue::OnUnsendable onUnsendable_;
  bool isBusy_ = false;  // it writes, or is due
  kj::Promise<void> parts_ = nullptr;  // the task that writes the rest
};

}  // namespace mpf::router
