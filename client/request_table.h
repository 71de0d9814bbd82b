// SPDX-License-Identifier: MIT
// RequestTable: the outstanding requests of one client.
//
// A request that was given up (cancelled, expired) has had its fate, but keeps its entry until the
// server replies to it or refuses it. The server identifies the request by the place of the entry,
// so no other request may use this place until then. A table begins small, because most clients
// have few requests at a time. When it grows, the entries in use stay where they are until they
// end.
//
// Threads  tryGrow(), tryReserve(), add() and takeBack(): one thread at a time, under the client's
//          lock. The rest: the dispatcher's thread, which holds this lock, too, if an entry may be
//          taken back meanwhile.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

#include <mpf/message.h>

namespace mpf {

struct Request {
  std::atomic<std::uint32_t> id{0};  // 0: free
  std::int32_t clientType = 0;
  std::int32_t clientExtra = 0;
  bool isGivenUp = false;  // used by the dispatcher's thread only
  std::int64_t deadlineNs = 0;
  std::int64_t sentNs = 0;  // of a timed request; else 0
  std::unique_ptr<Message> copy{};  // to be sent again if no server takes the request; else null

  // The number of its message on the link.
  [[nodiscard]] std::uint64_t ordinal() const noexcept {
    return ordinal_.load(std::memory_order_relaxed);
  }
  void setOrdinal(std::uint64_t ordinal) noexcept {
    ordinal_.store(ordinal, std::memory_order_relaxed);
  }

 private:
  std::atomic<std::uint64_t> ordinal_{0};
};

class RequestTable {
 public:
  //   maxOutstanding   of now; tryGrow() raises it
  //   lastId           of the previous connection's table: a late cancel() must not match a new
  //                    request
  explicit RequestTable(std::uint32_t maxOutstanding, std::uint32_t lastId = 0);

  [[nodiscard]] std::uint32_t lastId() const noexcept { return lastId_; }
  [[nodiscard]] std::uint32_t maxOutstanding() const noexcept { return max_; }

  [[nodiscard]] std::uint32_t outstanding() const noexcept {
    return added_.load(std::memory_order_relaxed) - ended_.load(std::memory_order_relaxed);
  }
  // Lets more requests be outstanding, once. Returns false if there is no memory.
  [[nodiscard]] bool tryGrow(std::uint32_t maxOutstanding) noexcept;

  // How many more may be outstanding. tryReserve() then finds a place for each, with a new id.
  [[nodiscard]] std::uint32_t room() const noexcept { return max_ - outstanding(); }

  // Requests that ended or were given up so far.
  [[nodiscard]] std::uint64_t answered() const noexcept {
    return answered_.load(std::memory_order_relaxed);
  }
  // Outstanding requests that were not given up.
  [[nodiscard]] std::uint32_t awaited() const noexcept {
    return added_.load(std::memory_order_relaxed) - static_cast<std::uint32_t>(answered());
  }

  // Returns a free entry, not yet added, for the given id, or for a new id when it is 0; nullptr
  // when the maximum is outstanding or another request has the place of that id.
  Request* tryReserve(std::uint32_t& id) noexcept {
    if (outstanding() >= max_) return nullptr;
    if (id != 0) return tryPlace(id);
    for (;;) {
      id = ++lastId_;
      if (id == 0) continue;
      if (auto* const request = tryPlace(id)) return request;
    }
  }
  void add(Request& request, std::uint32_t id) noexcept {
    added_.store(added_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    // PAIR(request-added): stored after the other fields of the entry.
    request.id.store(id, std::memory_order_release);
  }

  // Undoes add() when the message could not be sent. Returns the copy.
  std::unique_ptr<Message> takeBack(Request& request) noexcept {
    auto copy = std::move(request.copy);
    added_.store(added_.load(std::memory_order_relaxed) - 1, std::memory_order_relaxed);
    request.id.store(0, std::memory_order_relaxed);
    return copy;
  }

  // Returns the entry of an outstanding request, or nullptr.
  Request* find(std::uint32_t id) noexcept {
    auto& request = receiver_.at(id);
    // PAIR(request-added): the fields of the entry.
    if (id != 0 && request.id.load(std::memory_order_acquire) == id) return &request;
    return findInBoth(id);
  }
  void giveUp(Request& request) noexcept {
    request.isGivenUp = true;
    noteAnswered();
  }
  // Inline, because it is on the path of each reply.
  [[gnu::always_inline]] void end(Request& request) noexcept {
    if (!std::exchange(request.isGivenUp, false)) noteAnswered();
    if (request.copy) dropCopy(request);
    ended_.store(ended_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    // PAIR(request-ended): this thread no longer uses the entry.
    request.id.store(0, std::memory_order_release);
  }

  // The first entry in use from place `at` on, or nullptr. `at` becomes the place after it.
  Request* next(std::uint32_t& at) noexcept {
    const auto inFirst = first_.mask + 1;
    const auto all = inFirst + (hasGrown() ? second_.mask + 1 : 0);
    while (at < all) {
      auto& request = at < inFirst ? first_.at(at) : second_.at(at - inFirst);
      ++at;
      // PAIR(request-added): the fields of the entry.
      if (request.id.load(std::memory_order_acquire) != 0) return &request;
    }
    return nullptr;
  }
  template <class Visit>
  void forEach(Visit&& visit) {
    std::uint32_t at = 0;
    while (auto* const request = next(at)) visit(*request);
  }

 private:
  // Entries, whose number is a power of two.
  struct Places {
    Request* entries = nullptr;
    std::uint32_t mask = 0;
    [[nodiscard]] Request& at(std::uint32_t id) const noexcept { return entries[id & mask]; }
  };
  // The place of `id`, or nullptr if another request has it.
  [[nodiscard]] Request* tryPlace(std::uint32_t id) noexcept {
    auto& request = sender_.at(id);
    // PAIR(request-ended): the dispatcher's thread no longer uses the entry.
    const bool isFree =
        request.id.load(std::memory_order_acquire) == 0 && (!hasInFirst_ || !hasPlaceInFirst(id));
    return isFree ? &request : nullptr;
  }
  [[nodiscard]] bool hasPlaceInFirst(std::uint32_t id) noexcept;
  [[nodiscard]] bool hasGrown() const noexcept {
    // PAIR(table-grown): the second table.
    return hasGrown_.load(std::memory_order_acquire);
  }
  Request* findInBoth(std::uint32_t id) noexcept;
  void noteAnswered() noexcept { answered_.store(answered() + 1, std::memory_order_relaxed); }
  static void dropCopy(Request& request) noexcept;

  Places receiver_;  // the table in which the dispatcher's thread looks first
  Places sender_;  // the table for new requests; under the client's lock
  std::uint32_t max_;  // likewise
  std::uint32_t lastId_;  // likewise
  bool hasInFirst_ = false;  // likewise: requests may be in the first table beside those in sender_
  std::atomic<bool> hasGrown_{false};
  std::atomic<std::uint32_t> added_{0};
  std::atomic<std::uint32_t> ended_{0};
  std::atomic<std::uint64_t> answered_{0};
  std::unique_ptr<Request[]> firstEntries_;
  std::unique_ptr<Request[]> secondEntries_;
  Places first_;
  Places second_;  // after hasGrown()
};

}  // namespace mpf
