// SPDX-License-Identifier: MIT
// Company: processes that run beside an MPF round trip while it is timed.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "benchmarks/stage/measurement.h"

namespace mpf::bench {

// Starts the company from the requester's process after the server is ready; the company ends with
// the handle. Empty: nothing runs beside.
using Company = std::function<std::shared_ptr<void>()>;

// Measures the round trip of an Int32 beside `company`. Creates the backplane and removes it.
[[nodiscard]] Outcome roundTripBeside(const Stage& stage, const std::string& backplane, Mode mode,
                                      const Company& company);

}  // namespace mpf::bench
