// SPDX-License-Identifier: MIT
#include "router/transport/send_queue.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <utility>

#include "schema/conversion.h"
#include "schema/wire_places.h"
#include "shm/histogram.h"

namespace mpf::router {
namespace {

constexpr std::size_t kItemBytes = 256;  // upper estimate for an item without its body
// Memory that is kept for the next frame.
constexpr std::size_t kLeastScratch = std::size_t{16} << 10;
constexpr std::size_t kKeptScratch = std::size_t{4} << 20;
constexpr std::size_t kSpareRuns = 4;

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
  reply.setMissed(carried.message.getMissed());
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

void SendQueue::push(FillItem fill, Origin origin) {
  queue_.emplace_back(ControlItem{origin, std::move(fill)});
  ++controlItems_;
  if (origin == Origin::answer) ++answers_;
}

void SendQueue::push(Carried carried) {
  queue_.emplace_back(std::move(carried));
  ++messages_;
  countWaiting();
}

void SendQueue::push(const PlainOutgoing& item) {
  runWithRoom().append(item);
  ++messages_;
  countWaiting();
}

void SendQueue::push(const PlainItems& items) {
  for (std::size_t at = 0; at < items.run.size(); ++at) runWithRoom().append(items, at);
  messages_ += items.run.size();
  countWaiting();
}

PlainRun& SendQueue::runWithRoom() {
  auto* last = queue_.empty() ? nullptr : std::get_if<Run>(&queue_.back());
  if (last == nullptr || (*last)->isFull()) {
    queue_.emplace_back(takeSpareRun());
    last = std::get_if<Run>(&queue_.back());
  }
  return **last;
}

SendQueue::Run SendQueue::takeSpareRun() {
  if (spareRuns_.empty()) return std::make_unique<PlainRun>();
  auto run = std::move(spareRuns_.back());
  spareRuns_.pop_back();
  return run;
}

void SendQueue::reject(Carried carried) {
  if (carried.isRequest) rejectedRequests_.push_back(std::move(carried));
}

void SendQueue::reject(const PlainOutgoing& item) {
  reject(Carried{.isRequest = item.isRequest,
                 .client = item.client,
                 .requestId = item.requestId,
                 .message = {}});
}

void SendQueue::countWaiting() noexcept {
  record_->inQueue.store(messages_, std::memory_order_relaxed);
}

SendQueue::FrameSize SendQueue::sizeOfNextFrame(const FrameLimits& limits) const {
  FrameSize size{0, 0};
  for (const auto& outgoing : queue_) {
    if (std::holds_alternative<Run>(outgoing)) break;
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

void SendQueue::buildFrames(const FrameLimits& limits, const OnUnsendable& onUnsendable) {
  framesWritten();
  std::size_t bytes = 0;
  do {
    if (std::holds_alternative<Run>(queue_.front())) {
      bytes += buildPlainFrame();
    } else if (frame_.get() == nullptr) {
      bytes += buildOtherFrame(limits, onUnsendable);
    } else {
      break;  // its memory is in use
    }
  } while (!queue_.empty() && limits.items == SIZE_MAX && bytes < limits.bytes);
  countWaiting();
  count(record_->bytesSent, bytes);
}

SendQueue::Pieces SendQueue::part() {
  part_.clear();
  auto room = kPartBytes;
  for (auto at = nextPiece_; room != 0 && at != pieces_.size(); ++at) {
    const auto& piece = pieces_[at];
    const auto bytes = std::min(room, piece.size());
    if (bytes != 0) part_.push_back(piece.slice(0, bytes));
    room -= bytes;
  }
  return {part_.data(), part_.size()};
}

// Shortens the pieces from the front.
void SendQueue::partWritten(std::size_t bytes) noexcept {
  while (bytes != 0) {
    auto& piece = pieces_[nextPiece_];
    const auto written = std::min(bytes, piece.size());
    piece = piece.slice(written, piece.size());
    bytes -= written;
    if (piece.size() == 0) ++nextPiece_;
  }
}

std::size_t SendQueue::buildPlainFrame() {
  auto run = std::move(std::get<Run>(queue_.front()));
  queue_.pop_front();
  run->buildHead();
  messages_ -= run->size();
  count(record_->messagesSent, run->size());
  count(record_->framesSent);
  const auto bytes = run->head().size() + run->payload().size();
  pieces_.push_back(run->head());
  pieces_.push_back(run->payload());
  runs_.push_back(std::move(run));
  return bytes;
}

std::size_t SendQueue::buildOtherFrame(const FrameLimits& limits,
                                       const OnUnsendable& onUnsendable) {
  const auto [items, bytes] = sizeOfNextFrame(limits);
  makeScratch(bytes);
  frame_ = kj::heap<capnp::MallocMessageBuilder>(scratch_.asPtr());
  auto list = frame_->initRoot<wire::Frame>().initItems(static_cast<capnp::uint>(items));
  for (capnp::uint at = 0; at < items; ++at) {
    auto outgoing = std::move(queue_.front());
    queue_.pop_front();
    if (auto* item = std::get_if<ControlItem>(&outgoing)) {
      --controlItems_;
      if (item->origin == Origin::answer) --answers_;
      item->fill(list[at]);
    } else {
      --messages_;
      fill(list[at], std::get<Carried>(outgoing), limits.messageBytes, onUnsendable);
      count(record_->messagesSent);
    }
  }
  count(record_->framesSent);
  addPieces(*frame_);
  return frame_->sizeInWords() * sizeof(capnp::word);
}

// The stream framing of Cap'n Proto.
void SendQueue::addPieces(capnp::MallocMessageBuilder& frame) {
  const auto segments = frame.getSegmentsForOutput();
  table_.assign((segments.size() / 2 + 1) * 2, 0);
  const auto table = kj::arrayPtr(table_.data(), table_.size()).asBytes();
  storeLittle(table, 0, static_cast<std::uint32_t>(segments.size() - 1));
  for (std::size_t at = 0; at < segments.size(); ++at) {
    storeLittle(table, sizeof(std::uint32_t) * (at + 1),
                static_cast<std::uint32_t>(segments[at].size()));
  }
  pieces_.push_back(table);
  for (const auto segment : segments) pieces_.push_back(segment.asBytes());
}

void SendQueue::framesWritten() {
  pieces_.clear();
  nextPiece_ = 0;
  frame_ = nullptr;
  for (auto& run : runs_) {
    if (spareRuns_.size() == kSpareRuns) break;
    run->clear();
    spareRuns_.push_back(std::move(run));
  }
  runs_.clear();
}

std::vector<Carried> SendQueue::takeUnsentRequests() {
  std::vector<Carried> requests;
  for (auto& outgoing : queue_) {
    auto* carried = std::get_if<Carried>(&outgoing);
    if (carried != nullptr && carried->isRequest) requests.push_back(std::move(*carried));
    const auto* run = std::get_if<Run>(&outgoing);
    if (run == nullptr) continue;
    for (const auto& item : (*run)->items()) {
      if (item.isRequest)
        requests.push_back(
            {.isRequest = true, .client = item.client, .requestId = item.requestId, .message = {}});
    }
  }
  queue_.clear();
  messages_ = controlItems_ = answers_ = 0;
  std::ranges::move(std::exchange(rejectedRequests_, {}), std::back_inserter(requests));
  return requests;
}

}  // namespace mpf::router
