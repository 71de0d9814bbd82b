// SPDX-License-Identifier: MIT
#include "epics/record_queue.h"

#include <algorithm>
#include <utility>

namespace mpf {
namespace {

// Also the empty message, which is about the server: the record must not process for it now.
bool isFurtherReply(const Message& message) noexcept {
  return !endsRequest(message) && message.getType() != MessageType::connect;
}

}  // namespace

bool RecordQueue::push(Message&& message) {
  const std::lock_guard lock(mutex_);
  if (messages_.size() >= kMaxMessages && isFurtherReply(message)) dropOldest();
  messages_.push_back(std::move(message));
  return !std::exchange(isInCallbackQueue_, true);
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

bool RecordQueue::tryTake(Message& message, bool isRequestOutstanding) {
  const std::lock_guard lock(mutex_);
  const auto at = next(isRequestOutstanding);
  if (at == messages_.end()) return false;
  message = std::move(*at);
  messages_.erase(at);
  return true;
}

bool RecordQueue::finish(bool isRequestOutstanding) {
  const std::lock_guard lock(mutex_);
  isInCallbackQueue_ = next(isRequestOutstanding) != messages_.end();
  return isInCallbackQueue_;
}

std::uint64_t RecordQueue::overruns() const {
  const std::lock_guard lock(mutex_);
  return overruns_;
}

}  // namespace mpf
