// SPDX-License-Identifier: MIT
// Knocks: takes the knocks in the hints of our window: clients ask the owner to accept their links.
//
//   client  writes the incarnation of its link into one of kKnocks places, then counts `knocked`
//           sets `rescan` instead if it has overwritten the knock of another client
//
// Threads  one owner thread; peers knock at any time (PeerWindow::knock()).
// Trust    peers may write anything, without end: the owner limits the knocks that it takes at a
//          time, and checks each link before it accepts it.
#pragma once

#include <cstdint>
#include <optional>

#include "shm/layout.h"

namespace mpf {

class Knocks {
 public:
  explicit Knocks(layout::WindowHints& hints) noexcept : hints_(hints) {}

  // Whether tryTake() or takeRescan() may return something.
  [[nodiscard]] bool hasAny() const noexcept {
    return hints_.knocked.load(std::memory_order_relaxed) != knockedSeen_ ||
           hints_.rescan.load(std::memory_order_relaxed) != 0 || place_ != layout::kKnocks;
  }
  // The incarnation of a link whose client asks the owner to accept it.
  std::optional<std::uint64_t> tryTake() noexcept;
  // True if knocks were overwritten: the owner must search for new links by name.
  bool takeRescan() noexcept;

 private:
  layout::WindowHints& hints_;
  std::uint32_t knockedSeen_ = 0;
  std::uint32_t place_ = layout::kKnocks;  // the next place to look at; kKnocks: no more
};

}  // namespace mpf
