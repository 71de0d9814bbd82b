// SPDX-License-Identifier: MIT
// Company: what runs beside a round trip of ours while it is timed.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "benchmarks/stage/measurement.h"

namespace mpf::bench {

// Starts it, once the server is there, in the requester's process; it ends with the handle.
// nullptr: nobody.
using Company = std::function<std::shared_ptr<void>()>;

// The round trip of an Int32 beside it. The backplane is a new one, and removed.
[[nodiscard]] Outcome roundTripBeside(const Stage& stage, const std::string& backplane, Mode mode,
                                      const Company& company);

}  // namespace mpf::bench
