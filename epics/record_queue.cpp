// SPDX-License-Identifier: MIT
#include "epics/record_queue.h"

#include <algorithm>
#include <new>
#include <utility>

#include "epics/shared_client.h"

namespace mpf {
namespace {

// Also the empty message, which is about the server: the record must not process for it now.
bool isFurtherReply(const Message& message) noexcept {
  return !endsRequest(message) && message.getType() != MessageType::connect;
}

// A record has at most one such request.
bool completesIO(const Message& message) noexcept {
  return endsRequest(message) && SharedClient::replyTypeOf(message) == replyTypeCompleteIO;
}

}  // namespace

bool RecordQueue::push(Message&& message) noexcept {
  const std::lock_guard lock(mutex_);
  if (messages_.size() >= kMaxMessages && isFurtherReply(message)) dropOldest();
  keep(std::move(message));
  return !std::exchange(isInCallbackQueue_, true);
}

void RecordQueue::keep(Message&& message) noexcept try {
  messages_.push_back(std::move(message));
} catch (const std::bad_alloc&) {  // the message is unchanged
  if (message.getType() == MessageType::connect) connect_ = std::move(message);
  else if (completesIO(message)) end_ = std::move(message);
  else ++overruns_;
}

Message* RecordQueue::reserved() noexcept {
  if (end_) return &end_;
  return connect_ ? &connect_ : nullptr;
}

void RecordQueue::dropOldest() {
  const auto oldest = std::ranges::find_if(messages_, isFurtherReply);
  if (oldest == messages_.end()) return;
  messages_.erase(oldest);
  ++overruns_;
}

std::deque<Message>::iterator RecordQueue::next(bool isRequestOutstanding) {
  return isRequestOutstanding ? std::ranges::find_if_not(messages_, isFurtherReply)
                              : messages_.begin();
}

bool RecordQueue::tryTake(Message& message, bool isRequestOutstanding) noexcept {
  const std::lock_guard lock(mutex_);
  if (const auto at = next(isRequestOutstanding); at != messages_.end()) {
    message = std::move(*at);
    messages_.erase(at);
    return true;
  }
  auto* const last = reserved();
  if (last == nullptr) return false;
  message = std::exchange(*last, {});
  return true;
}

bool RecordQueue::finish(bool isRequestOutstanding) noexcept {
  const std::lock_guard lock(mutex_);
  isInCallbackQueue_ = next(isRequestOutstanding) != messages_.end() || reserved() != nullptr;
  return isInCallbackQueue_;
}

std::uint64_t RecordQueue::overruns() const {
  const std::lock_guard lock(mutex_);
  return overruns_;
}

}  // namespace mpf
