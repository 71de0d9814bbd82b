// SPDX-License-Identifier: MIT
// UntakenRequests: the requests of one client that no server has received, and that the client
// sends to the next server (Retry::neverTaken), in their order.
//
// Threads  the dispatcher's thread changes them, under the sender's lock; any thread asks isEmpty()
//          under that lock.
#pragma once

#include <algorithm>
#include <cstdint>
#include <list>
#include <memory>
#include <new>
#include <optional>

#include <mpf/message.h>

#include "client/request_table.h"

namespace mpf {

struct UntakenRequest {
  std::uint32_t id = 0;
  std::int64_t deadlineNs = 0;  // 0: none
  std::unique_ptr<Message> message{};

  [[nodiscard]] bool hasExpired(std::int64_t nowNs) const noexcept {
    return deadlineNs != 0 && deadlineNs <= nowNs;
  }
};

class UntakenRequests {
 public:
  [[nodiscard]] bool isEmpty() const noexcept { return requests_.empty(); }
  [[nodiscard]] UntakenRequest& front() noexcept { return requests_.front(); }
  [[nodiscard]] const std::list<UntakenRequest>& all() const noexcept { return requests_; }
  // Takes the copy of a request of the table, which ends then without a fate. Requests may come in
  // any order. Returns false, with the request unchanged, if there is no memory.
  [[nodiscard]] bool tryAdd(Request& request) noexcept try {
    const auto id = request.id.load(std::memory_order_relaxed);
    const auto isSentBefore = [id](const UntakenRequest& other) {
      return static_cast<std::int32_t>(other.id - id) < 0;  // ids begin again after the largest one
    };
    const auto added = requests_.emplace(std::ranges::find_if_not(requests_, isSentBefore));
    *added = {id, request.deadlineNs, std::move(request.copy)};
    return true;
  } catch (const std::bad_alloc&) {
    return false;
  }
  void removeFront() noexcept { requests_.pop_front(); }
  // Removes and returns the first request for which `isWanted` is true.
  template <class Predicate>
  std::optional<UntakenRequest> take(Predicate&& isWanted) {
    const auto found = std::ranges::find_if(requests_, isWanted);
    if (found == requests_.end()) return {};
    auto request = std::move(*found);
    requests_.erase(found);
    return request;
  }

 private:
  std::list<UntakenRequest> requests_;  // an empty deque would need 576 bytes
};

}  // namespace mpf
