// SPDX-License-Identifier: MIT
// The sending side of Line: the queue, and the frames that are built from it.
#include <algorithm>
#include <capnp/serialize-async.h>
#include <iterator>

#include "router/transport/line.h"
#include "router/transport/tls.h"

namespace mpf::router {
namespace {

constexpr std::size_t kItemBytes = 256;  // upper estimate for an item without its body
// Memory that is kept for the next frame.
constexpr std::size_t kKeptScratch = std::size_t{4} << 20;

}  // namespace

void Line::send(Note note) {
  if (isEnding()) return;
  if (handling_) {
    queue_.emplace_back(Answer{std::move(note)});
    ++answers_;
  } else {
    queue_.emplace_back(std::move(note));
  }
  scheduleWrite();
}

void Line::send(Carried carried) {
  if (isEnding()) {
    if (carried.isRequest) lateRequests_.push_back(std::move(carried));
    return;
  }
  queue_.emplace_back(std::move(carried));
  ++waiting_;
  noteQueue();
  scheduleWrite();
}

void Line::noteQueue() noexcept { record_->inQueue.store(waiting_, std::memory_order_relaxed); }

// Writes after all tasks that are ready now, so that what they send shares the frame.
void Line::scheduleWrite() {
  if (std::exchange(writing_, true)) return;
  writes_ =
      kj::evalLast([this] { return writeAll(); }).eagerlyEvaluate([this](kj::Exception&& error) {
        onWriteFailure(tlsProblem(error));
      });
}

// Keeps reading for a while: the peer may have sent a farewell with the reason.
void Line::onWriteFailure(const std::string& why) {
  if (isEnding()) return finish({farewell_.empty() ? why : farewell_});
  phase_ = Phase::broken;
  farewellTimer_ = timer_.afterDelay(kFarewellTime)
                       .then([this, why] { finish({why}); })
                       .eagerlyEvaluate(nullptr);
}

kj::Promise<void> Line::writeAll() {
  if (queue_.empty()) {
    writing_ = false;
    if (isEnding() && drains_) stream_->shutdownWrite();
    else if (isEnding()) finish({farewell_});
    return kj::READY_NOW;
  }
  buildFrame();
  count(record_->framesSent);
  return capnp::writeMessage(*stream_, *frame_).then([this] {
    frame_ = nullptr;
    if (resumeReading_) {
      // The peer is alive: it reads, while its own items are not read here.
      lastReceiveNs_ = Clock::nowNs();
      if (answers_ < kMaxNotes) std::exchange(resumeReading_, nullptr)->fulfill();
    }
    if (!isEnding()) owner_.onRoom();
    return writeAll();
  });
}

// The items for the next frame: at least one, and as many as fit into Limits::bufferBytes.
Line::FrameSize Line::sizeOfNextFrame() const {
  FrameSize size{0, 0};
  for (const auto& outgoing : queue_) {
    const auto* carried = std::get_if<Carried>(&outgoing);
    const auto bytes = kItemBytes + (carried != nullptr ? carried->message.body().size() : 0);
    if (size.items != 0 && size.bytes + bytes > limits_.bufferBytes) break;
    ++size.items;
    size.bytes += bytes;
    if (!greeted_) break;  // the greeting has a frame of its own
  }
  return size;
}

// Prepares zeroed memory for the next frame. It is kept from frame to frame.
void Line::makeScratch(std::size_t bytes) {
  constexpr std::size_t kLeast = std::size_t{16} << 10;
  bytes = std::min(kLeast + bytes, kKeptScratch);
  if (scratch_.size() * sizeof(capnp::word) >= bytes) return;
  scratch_ = kj::heapArray<capnp::word>(bytes / sizeof(capnp::word) + 1);
  std::memset(scratch_.asBytes().begin(), 0, scratch_.asBytes().size());
}

void Line::buildFrame() {
  const auto [items, bytes] = sizeOfNextFrame();
  makeScratch(bytes);
  frame_ = kj::heap<capnp::MallocMessageBuilder>(scratch_.asPtr());
  auto list = frame_->initRoot<wire::Frame>().initItems(static_cast<capnp::uint>(items));
  for (capnp::uint at = 0; at < items; ++at) {
    auto outgoing = std::move(queue_.front());
    queue_.pop_front();
    if (auto* note = std::get_if<Note>(&outgoing)) {
      (*note)(list[at]);
    } else if (auto* answer = std::get_if<Answer>(&outgoing)) {
      --answers_;
      answer->note(list[at]);
    } else {
      build(list[at], std::get<Carried>(outgoing));
      --waiting_;
      count(record_->messagesSent);
    }
  }
  noteQueue();
  count(record_->bytesSent, frame_->sizeInWords() * sizeof(capnp::word));
}

void Line::build(wire::Item::Builder item, Carried& carried) {
  const ConversionLimits limits{static_cast<std::size_t>(maxMessageBytes())};
  ConversionError error;
  bool isConverted = false;
  if (carried.isRequest) {
    auto request = item.initRequest();
    request.setClient(carried.client);
    request.setRequestId(carried.requestId);
    // The far side handles a deadline that has already passed like any other.
    if (!carried.takeBefore.isNever())
      request.setTakeWithinNs(
          static_cast<std::uint64_t>(std::max<std::int64_t>(carried.takeBefore.left().count(), 1)));
    isConverted = tryToWire(carried.message, request.initMessage(), limits, error);
  } else {
    auto reply = item.initReply();
    reply.setClient(carried.client);
    reply.setRequestId(carried.requestId);
    reply.setIsFirst(carried.isFirst);
    isConverted = tryToWire(carried.message, reply.initMessage(), limits, error);
  }
  if (isConverted) return;
  item.setNone();
  owner_.onUnsendable(carried, error.text, item);
}

std::vector<Carried> Line::takeUnsentRequests() {
  std::vector<Carried> requests;
  for (auto& outgoing : queue_) {
    auto* carried = std::get_if<Carried>(&outgoing);
    if (carried != nullptr && carried->isRequest) requests.push_back(std::move(*carried));
  }
  queue_.clear();
  std::ranges::move(std::exchange(lateRequests_, {}), std::back_inserter(requests));
  return requests;
}

}  // namespace mpf::router
