// SPDX-License-Identifier: MIT
// Addresses, deadlines and bytes for tests of GPIB controllers.
#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <string_view>

#include <mpf/clock.h>
#include <mpf/drivers/gpib/gpib_types.h>

#include "tests/support/watchdog.h"

namespace mpf::test {

inline constexpr GpibAddress kEcho{.primary = 22};
inline constexpr GpibAddress kOther{.primary = 9, .secondary = 5};
inline constexpr GpibAddress kAbsent{.primary = 7};
inline constexpr GpibReadLimits kUntilEnd{.maxBytes = 4 << 20};

// For operations that succeed: only ends a test that hangs.
inline Deadline patient() { return Deadline::after(Watchdog::kPatience); }
// For operations that time out.
inline Deadline soon() { return Deadline::after(std::chrono::milliseconds(200)); }

// Calls `act` with deadlines that are further and further away, until it returns true: for results
// that a busy host may not reach before a near deadline.
template <class Act>
void withLaterDeadlines(const Act& act) {
  for (auto wait = std::chrono::milliseconds(200); !act(Deadline::after(wait)); wait *= 2) continue;
}

inline std::span<const std::uint8_t> raw(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

}  // namespace mpf::test
