// SPDX-License-Identifier: MIT
#include "router/transport/send_queue.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <utility>

#include "schema/conversion.h"
#include "shm/histogram.h"

namespace mpf::router {
namespace {

constexpr std::size_t kItemBytes = 256;  // upper estimate for an item without its body
// Memory that is kept for the next frame.
constexpr std::size_t kLeastScratch = std::size_t{16} << 10;
constexpr std::size_t kKeptScratch = std::size_t{4} << 20;

// Returns false when the message cannot be converted, for the reason in `error`.
bool tryFillRequest(wire::Request::Builder request, Carried& carried,
                    const ConversionLimits& limits, ConversionError& error) {
  request.setClient(carried.client);
  request.setRequestId(carried.requestId);
  // The far side handles a deadline that has already passed like any other.
  if (!carried.takeBefore.isNever())
    request.setTakeWithinNs(
        static_cast<std::uint64_t>(std::max<std::int64_t>(carried.takeBefore.left().count(), 1)));
  return tryToWire(carried.message, request.initMessage(), limits, error);
}

bool tryFillReply(wire::Reply::Builder reply, Carried& carried, const ConversionLimits& limits,
                  ConversionError& error) {
  reply.setClient(carried.client);
  reply.setRequestId(carried.requestId);
  reply.setIsFirst(carried.isFirst);
  return tryToWire(carried.message, reply.initMessage(), limits, error);
}

void fill(wire::Item::Builder item, Carried& carried, std::uint64_t maxMessageBytes,
          const SendQueue::OnUnsendable& onUnsendable) {
  const ConversionLimits limits{static_cast<std::size_t>(maxMessageBytes)};
  ConversionError error;
  if (carried.isRequest ? tryFillRequest(item.initRequest(), carried, limits, error)
                        : tryFillReply(item.initReply(), carried, limits, error))
    return;
  item.setNone();
  onUnsendable(carried, error.text, item);
}

}  // namespace

SendQueue::SendQueue(std::uint32_t queueSize, PeerRecord& record)
    : queueSize_(queueSize), record_(record) {
  record_->queueSize.store(queueSize, std::memory_order_relaxed);
}

void SendQueue::push(Note note, NoteKind kind) {
  queue_.emplace_back(KindedNote{kind, std::move(note)});
  if (kind == NoteKind::answer) ++answers_;
}

void SendQueue::push(Carried carried) {
  queue_.emplace_back(std::move(carried));
  ++messages_;
  countWaiting();
}

void SendQueue::reject(Carried carried) {
  if (carried.isRequest) rejectedRequests_.push_back(std::move(carried));
}

void SendQueue::countWaiting() noexcept {
  record_->inQueue.store(messages_, std::memory_order_relaxed);
}

SendQueue::FrameSize SendQueue::sizeOfNextFrame(const FrameLimits& limits) const {
  FrameSize size{0, 0};
  for (const auto& outgoing : queue_) {
    const auto* carried = std::get_if<Carried>(&outgoing);
    const auto bytes = kItemBytes + (carried != nullptr ? carried->message.body().size() : 0);
    if (size.items != 0 && size.bytes + bytes > limits.bytes) break;
    ++size.items;
    size.bytes += bytes;
    if (size.items == limits.items) break;
  }
  return size;
}

// Prepares zeroed memory. The builder of the previous frame has left its memory zeroed.
void SendQueue::makeScratch(std::size_t bytes) {
  bytes = std::min(kLeastScratch + bytes, kKeptScratch);
  if (scratch_.size() * sizeof(capnp::word) >= bytes) return;
  scratch_ = kj::heapArray<capnp::word>(bytes / sizeof(capnp::word) + 1);
  std::memset(scratch_.asBytes().begin(), 0, scratch_.asBytes().size());
}

capnp::MessageBuilder& SendQueue::buildFrame(const FrameLimits& limits,
                                             const OnUnsendable& onUnsendable) {
  const auto [items, bytes] = sizeOfNextFrame(limits);
  frameWritten();
  makeScratch(bytes);
  frame_ = kj::heap<capnp::MallocMessageBuilder>(scratch_.asPtr());
  auto list = frame_->initRoot<wire::Frame>().initItems(static_cast<capnp::uint>(items));
  for (capnp::uint at = 0; at < items; ++at) {
    auto outgoing = std::move(queue_.front());
    queue_.pop_front();
    if (auto* note = std::get_if<KindedNote>(&outgoing)) {
      if (note->kind == NoteKind::answer) --answers_;
      note->fill(list[at]);
    } else {
      --messages_;
      fill(list[at], std::get<Carried>(outgoing), limits.messageBytes, onUnsendable);
      count(record_->messagesSent);
    }
  }
  countWaiting();
  count(record_->framesSent);
  count(record_->bytesSent, frame_->sizeInWords() * sizeof(capnp::word));
  return *frame_;
}

std::vector<Carried> SendQueue::takeUnsentRequests() {
  std::vector<Carried> requests;
  for (auto& outgoing : queue_) {
    auto* carried = std::get_if<Carried>(&outgoing);
    if (carried != nullptr && carried->isRequest) requests.push_back(std::move(*carried));
  }
  queue_.clear();
  messages_ = answers_ = 0;
  std::ranges::move(std::exchange(rejectedRequests_, {}), std::back_inserter(requests));
  return requests;
}

}  // namespace mpf::router
