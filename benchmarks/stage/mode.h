// SPDX-License-Identifier: MIT
// Mode: how both sides of a measurement wait.
#pragma once

#include <cstdint>

namespace mpf::bench {

enum class Mode : std::uint32_t { spin, adaptive, block };

[[nodiscard]] inline const char* toString(Mode mode) noexcept {
  switch (mode) {
    case Mode::spin:
      return "spin";
    case Mode::adaptive:
      return "adaptive";
    case Mode::block:
      return "block";
  }
  return "?";
}

}  // namespace mpf::bench
