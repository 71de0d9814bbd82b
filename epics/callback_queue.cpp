// SPDX-License-Identifier: MIT
#include "epics/callback_queue.h"

#include <utility>

namespace mpf {

CallbackQueue::CallbackQueue(int priority) {
  callbackSetCallback(onCallback, &callback_);
  callbackSetUser(this, &callback_);
  callbackSetPriority(priority, &callback_);
}

void CallbackQueue::add(Record& record) noexcept {
  const std::lock_guard lock(mutex_);
  record.next_ = nullptr;
  *end_ = &record;
  end_ = &record.next_;
}

void CallbackQueue::flush() {
  const std::lock_guard lock(mutex_);
  if (!isPending_ && first_ != nullptr) isPending_ = callbackRequest(&callback_) == 0;
}

void CallbackQueue::clear() {
  const std::lock_guard lock(mutex_);
  takeAll();
  isPending_ = false;
}

void CallbackQueue::onCallback(epicsCallback* callback) {
  void* user = nullptr;
  callbackGetUser(user, callback);
  static_cast<CallbackQueue*>(user)->processAll();
}

void CallbackQueue::processAll() {
  std::unique_lock lock(mutex_);
  auto* next = takeAll();
  lock.unlock();
  while (next != nullptr) {
    auto& record = *next;
    next = record.next_;  // read first: a record that leaves the queue may be added at once
    if (record.processOne()) add(record);
  }
  lock.lock();
  isPending_ = false;
  lock.unlock();
  flush();  // other callbacks of the IOC have their turn first
}

CallbackQueue::Record* CallbackQueue::takeAll() noexcept {
  end_ = &first_;
  return std::exchange(first_, nullptr);
}

}  // namespace mpf
