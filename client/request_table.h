// SPDX-License-Identifier: MIT
// RequestTable: the requests of one client that its server owes a reply. A request that was given
// up (cancelled, expired) has had its end, and stays until the server is through with it: the
// server knows it by its place in the table, which nobody else may get before.
//
// Threads  add(): one thread at a time, under the client's lock. The rest: the dispatcher's thread.
#pragma once

#include <atomic>
#include <bit>
#include <cstdint>
#include <memory>
#include <utility>

namespace mpf {

struct Request {
  std::atomic<std::uint32_t> id{0};  // 0: free
  std::int32_t clientType = 0;
  std::int32_t clientExtra = 0;
  std::uint64_t ordinal = 0;  // number of its message on the link
  std::int64_t deadlineNs = 0;
  std::int64_t sentNs = 0;  // of a timed request; else 0
  bool isGivenUp = false;  // the dispatcher's
};

class RequestTable {
 public:
  // `lastId`: of the table before, so that a late cancel() does not meet a request of the next
  // connection.
  explicit RequestTable(std::uint32_t maxOutstanding, std::uint32_t lastId = 0)
      : size_(std::bit_ceil(maxOutstanding)),
        max_(maxOutstanding),
        requests_(std::make_unique<Request[]>(size_)),
        lastId_(lastId) {}

  [[nodiscard]] std::uint32_t lastId() const noexcept { return lastId_; }

  [[nodiscard]] std::uint32_t outstanding() const noexcept {
    return added_.load(std::memory_order_relaxed) - ended_.load(std::memory_order_relaxed);
  }

  // Without those that were given up.
  [[nodiscard]] std::uint32_t awaited() const noexcept {
    return outstanding() - givenUp_.load(std::memory_order_relaxed);
  }

  // A free entry, not yet added, with the id asked for or, for 0, one of its own; nullptr when max
  // are outstanding, or another one has that place.
  Request* tryReserve(std::uint32_t& id) noexcept {
    if (outstanding() >= max_) return nullptr;
    if (id != 0) {
      auto& request = requests_[id & (size_ - 1)];
      // PAIR(request-ended): the dispatcher has finished with the entry.
      return request.id.load(std::memory_order_acquire) == 0 ? &request : nullptr;
    }
    for (;;) {
      id = ++lastId_;
      auto& request = requests_[id & (size_ - 1)];
      // PAIR(request-ended): the dispatcher has finished with the entry.
      if (id != 0 && request.id.load(std::memory_order_acquire) == 0) return &request;
    }
  }
  void add(Request& request, std::uint32_t id) noexcept {
    added_.store(added_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    // PAIR(request-added): after its fields.
    request.id.store(id, std::memory_order_release);
  }

  // Its message was not sent after all.
  void takeBack(Request& request) noexcept {
    added_.store(added_.load(std::memory_order_relaxed) - 1, std::memory_order_relaxed);
    request.id.store(0, std::memory_order_relaxed);
  }

  // The request, if the server owes it a reply.
  Request* find(std::uint32_t id) noexcept {
    auto& request = requests_[id & (size_ - 1)];
    // PAIR(request-added): its fields.
    return id != 0 && request.id.load(std::memory_order_acquire) == id ? &request : nullptr;
  }
  void giveUp(Request& request) noexcept {
    request.isGivenUp = true;
    givenUp_.store(givenUp_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
  void end(Request& request) noexcept {
    if (std::exchange(request.isGivenUp, false))
      givenUp_.store(givenUp_.load(std::memory_order_relaxed) - 1, std::memory_order_relaxed);
    ended_.store(ended_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    // PAIR(request-ended): we have finished with the entry.
    request.id.store(0, std::memory_order_release);
  }

  template <class Visit>
  void forEach(Visit&& visit) {
    for (std::uint32_t at = 0; at < size_; ++at) {
      // PAIR(request-added): its fields.
      if (requests_[at].id.load(std::memory_order_acquire) != 0) visit(requests_[at]);
    }
  }

 private:
  std::uint32_t size_;
  std::uint32_t max_;
  std::unique_ptr<Request[]> requests_;
  std::uint32_t lastId_;
  std::atomic<std::uint32_t> added_{0};
  std::atomic<std::uint32_t> ended_{0};
  std::atomic<std::uint32_t> givenUp_{0};
};

}  // namespace mpf
