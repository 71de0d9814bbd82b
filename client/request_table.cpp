// SPDX-License-Identifier: MIT
#include "client/request_table.h"

#include <bit>
#include <new>

namespace mpf {

RequestTable::RequestTable(std::uint32_t maxOutstanding, std::uint32_t lastId)
    : max_(maxOutstanding), lastId_(lastId) {
  const auto size = std::bit_ceil(maxOutstanding);
  firstEntries_ = std::make_unique<Request[]>(size);
  first_ = receiver_ = sender_ = {firstEntries_.get(), size - 1};
}

bool RequestTable::tryGrow(std::uint32_t maxOutstanding) noexcept {
  if (maxOutstanding <= max_) return true;
  if (secondEntries_) return false;
  const auto size = std::bit_ceil(maxOutstanding);
  secondEntries_.reset(new (std::nothrow) Request[size]);
  if (!secondEntries_) return false;
  second_ = sender_ = {secondEntries_.get(), size - 1};
  max_ = maxOutstanding;
  hasInFirst_ = true;
  // PAIR(table-grown): the second table is complete.
  hasGrown_.store(true, std::memory_order_release);
  return true;
}

// Whether a request in the first table has the place that `id` would have in the second one. Once
// in as many ids as the first table has entries, it checks whether that table is empty.
bool RequestTable::hasPlaceInFirst(std::uint32_t id) noexcept {
  if ((id & first_.mask) == 0) {
    hasInFirst_ = false;
    for (std::uint32_t at = 0; at <= first_.mask; ++at)
      hasInFirst_ = hasInFirst_ || first_.at(at).id.load(std::memory_order_relaxed) != 0;
  }
  const auto other = first_.at(id).id.load(std::memory_order_relaxed);
  return other != 0 && ((other ^ id) & sender_.mask) == 0;
}

// For a request that is not in the table in which we look first.
Request* RequestTable::findInBoth(std::uint32_t id) noexcept {
  if (id == 0 || !hasGrown()) return nullptr;
  receiver_ = second_;
  for (const auto& places : {second_, first_}) {
    auto& request = places.at(id);
    // PAIR(request-added): the fields of the entry.
    if (request.id.load(std::memory_order_acquire) == id) return &request;
  }
  return nullptr;
}

// Not inline, so that end() is.
void RequestTable::dropCopy(Request& request) noexcept { request.copy.reset(); }

}  // namespace mpf
