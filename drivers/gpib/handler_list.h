// SPDX-License-Identifier: MIT
// HandlerList: functions that are called with the same arguments, until their subscription ends.
//
//   const auto entry = list.add(handler);   // handler is called until `entry` is destroyed
//
// Threads  any. call() holds the lock: add() and the end of an entry wait for handlers that run,
//          and deadlock when a handler of the same list calls them.
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace mpf {

template <class... Arguments>
class HandlerList {
 public:
  using Handler = std::function<void(Arguments...)>;

  HandlerList() = default;
  HandlerList(const HandlerList&) = delete;
  HandlerList& operator=(const HandlerList&) = delete;

  // The list must outlive the returned entry.
  [[nodiscard]] std::shared_ptr<void> add(Handler handler) {
    return std::make_shared<Entry>(*this, std::move(handler));
  }
  [[nodiscard]] bool isEmpty() const {
    const std::lock_guard lock(mutex_);
    return entries_.empty();
  }
  // In the order of add().
  void call(Arguments... arguments) const {
    const std::lock_guard lock(mutex_);
    for (const auto* const entry : entries_) entry->handler(arguments...);
  }

 private:
  struct Entry {
    Entry(HandlerList& ofList, Handler&& called) : list(ofList), handler(std::move(called)) {
      const std::lock_guard lock(list.mutex_);
      list.entries_.push_back(this);
    }
    ~Entry() {
      const std::lock_guard lock(list.mutex_);
      std::erase(list.entries_, this);
    }
    Entry(const Entry&) = delete;
    Entry& operator=(const Entry&) = delete;
    HandlerList& list;
    const Handler handler;
  };

  mutable std::mutex mutex_;
  std::vector<Entry*> entries_;
};

}  // namespace mpf
