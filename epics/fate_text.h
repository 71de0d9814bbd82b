// SPDX-License-Identifier: MIT
// textOf(): the fate of a request as the alarm message (AMSG) of its record.
//
// Threads  any.
#pragma once

#include <mpf/message_types.h>

namespace mpf {

[[nodiscard]] constexpr const char* textOf(Fate fate) noexcept {
  switch (fate) {
    case Fate::refused:
      return "the server refused the request";
    case Fate::neverTaken:
      return "disconnected before the request";
    case Fate::outcomeUnknown:
      return "disconnected before the reply";
    case Fate::expired:
    case Fate::cancelled:
      break;
  }
  return "no reply in time";
}

}  // namespace mpf
