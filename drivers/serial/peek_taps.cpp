// SPDX-License-Identifier: MIT
#include <mpf/drivers/serial/peek_taps.h>

#include <utility>

namespace mpf {

PeekTap& PeekTap::operator=(PeekTap&& other) noexcept {
  if (this == &other) return *this;
  detach();
  taps_ = std::move(other.taps_);
  id_ = other.id_;
  return *this;
}

PeekTap::~PeekTap() { detach(); }

void PeekTap::detach() noexcept {
  if (const auto taps = std::exchange(taps_, nullptr)) taps->detach(id_);
}

PeekTap PeekTaps::attach(PeekHandler handler) {
  const std::lock_guard lock(mutex_);
  entries_.push_back({++lastId_, std::move(handler)});
  return {shared_from_this(), lastId_};
}

void PeekTaps::detach(std::uint64_t id) noexcept {
  const std::lock_guard lock(mutex_);
  std::erase_if(entries_, [&](const Entry& entry) { return entry.id == id; });
}

bool PeekTaps::isEmpty() const noexcept {
  const std::lock_guard lock(mutex_);
  return entries_.empty();
}

void PeekTaps::show(std::span<const PeekedByte> bytes) const noexcept {
  const std::lock_guard lock(mutex_);
  for (const auto& entry : entries_) entry.handler(bytes);
}

}  // namespace mpf
