// SPDX-License-Identifier: MIT
#include "epics/callback_queue.h"

#include <algorithm>

namespace mpf {

CallbackQueue::CallbackQueue(int priority) {
  callbackSetCallback(onCallback, &callback_);
  callbackSetUser(this, &callback_);
  callbackSetPriority(priority, &callback_);
}

void CallbackQueue::add(Record& record) {
  const std::lock_guard lock(mutex_);
  waiting_.push_back(&record);
}

void CallbackQueue::flush() {
  const std::lock_guard lock(mutex_);
  if (!isPending_ && !waiting_.empty()) isPending_ = callbackRequest(&callback_) == 0;
}

void CallbackQueue::clear() {
  const std::lock_guard lock(mutex_);
  waiting_.clear();
  isPending_ = false;
}

void CallbackQueue::onCallback(epicsCallback* callback) {
  void* user = nullptr;
  callbackGetUser(user, callback);
  static_cast<CallbackQueue*>(user)->processAll();
}

void CallbackQueue::processAll() {
  {
    const std::lock_guard lock(mutex_);
    taken_.swap(waiting_);
  }
  std::erase_if(taken_, [](Record* record) { return !record->processOne(); });
  {
    const std::lock_guard lock(mutex_);
    waiting_.insert(waiting_.end(), taken_.begin(), taken_.end());
    taken_.clear();
    isPending_ = false;
  }
  flush();  // other callbacks of the IOC have their turn first
}

}  // namespace mpf
