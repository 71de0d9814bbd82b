// SPDX-License-Identifier: MIT
// Shortages: what the process of a server, or its host, lacks to accept another client, and what to
// do.
#pragma once

#include <exception>

#include "shm/layout.h"

namespace mpf {

// The shortage that made an operation fail; `none` when `error` has another reason.
[[nodiscard]] layout::Shortage shortageOf(const std::exception& error) noexcept;

// What is missing, as the end of a sentence, and a remedy. Empty for `none` and for a value
// that this version does not know.
struct ShortageText {
  const char* lack = "";
  const char* remedy = "";
};
[[nodiscard]] ShortageText textOf(layout::Shortage shortage) noexcept;

}  // namespace mpf
