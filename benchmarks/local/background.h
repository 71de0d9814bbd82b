// SPDX-License-Identifier: MIT
// Background: processes that run beside an MPF round trip while it is timed.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "benchmarks/stage/measurement.h"

namespace mpf::bench {

// Starts the background processes from the requester's process after the server is ready; they
// end with the handle. Empty: nothing runs beside.
using Background = std::function<std::shared_ptr<void>()>;

// Measures the round trip of an Int32 beside `background`. Creates the backplane and removes it.
[[nodiscard]] Outcome roundTripBeside(const Stage& stage, const std::string& backplane, Mode mode,
                                      const Background& background);

}  // namespace mpf::bench
