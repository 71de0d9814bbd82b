// SPDX-License-Identifier: MIT
// `mpf bench local`: measures MPF beside the hardware limits and beside other message systems, in
// one run on two CPUs.
//
//   mpf::bench::Options options;
//   mpf::bench::addOptions(*bench.add_subcommand("local", mpf::bench::kLocalHelp), options);
//   ... return mpf::bench::runLocal(options);
#pragma once

#include "benchmarks/local/session.h"

namespace mpf::bench {

inline constexpr const char* kLocalHelp =
    "Measures messages on this host, beside the hardware limits and other message systems";

// Returns the exit status of the program: 0 all rows were measured or left out with a reason, 1 a
// row failed, 2 usage error.
[[nodiscard]] int runLocal(const Options& options);

}  // namespace mpf::bench
