// SPDX-License-Identifier: MIT
#include "router/transport/frame_writer.h"

namespace mpf::router {
namespace {

std::size_t bytesOf(SendQueue::Pieces pieces) {
  std::size_t bytes = 0;
  for (const auto piece : pieces) bytes += piece.size();
  return bytes;
}

}  // namespace

FrameWriter::FrameWriter(Owner& owner, kj::AsyncIoStream& stream, DirectIo direct,
                         DueWrites& writes, SendQueue queue, SendQueue::OnUnsendable onUnsendable)
    : owner_(owner),
      stream_(stream),
      direct_(direct),
      writes_(writes),
      queue_(std::move(queue)),
      onUnsendable_(std::move(onUnsendable)) {}

void FrameWriter::writeDue() noexcept {
  KJ_IF_MAYBE (error, kj::runCatchingExceptions([this] { writeFrames(); }))
    owner_.onWriteFailure(*error);
}

// Leaves the rest to the stream when the kernel has no room or a frame exceeds kPartBytes. After
// kPartBytes in shorter frames, the next DueWrites::run() continues.
void FrameWriter::writeFrames() {
  std::size_t written = 0;
  while (!queue_.isEmpty()) {
    if (written >= SendQueue::kPartBytes) return writes_.add(*this);
    buildFrames();
    written += writePart();
    if (queue_.part().size() != 0) {
      parts_ = writeAll().eagerlyEvaluate(
          [this](kj::Exception&& error) { owner_.onWriteFailure(error); });
      return;
    }
    framesWritten();
  }
  becomeIdle();
}

// Returns how many bytes it has written.
std::size_t FrameWriter::writePart() {
  const auto written = direct_.tryWrite(queue_.part());
  queue_.partWritten(written);
  return written;
}

kj::Promise<void> FrameWriter::writeAll() {
  return writeParts().then([this]() -> kj::Promise<void> {
    framesWritten();
    if (!queue_.isEmpty()) {
      buildFrames();
      return writeAll();
    }
    becomeIdle();
    return kj::READY_NOW;
  });
}

// Writes the frames in parts, because each part that is written shows that the peer reads: a slow
// one may need longer than dead-time for a long frame.
kj::Promise<void> FrameWriter::writeParts() {
  const auto part = queue_.part();
  if (part.size() == 0) return kj::READY_NOW;
  return stream_.write(part).then([this, bytes = bytesOf(part)] {
    queue_.partWritten(bytes);
    owner_.onPart();
    return writeParts();
  });
}

void FrameWriter::framesWritten() {
  owner_.onWritten();
  queue_.framesWritten();
}

void FrameWriter::becomeIdle() {
  isBusy_ = false;
  owner_.onIdle();
}

}  // namespace mpf::router
