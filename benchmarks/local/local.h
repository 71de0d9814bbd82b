// SPDX-License-Identifier: MIT
// `mpf bench local`: measures ours beside the physical floors and beside other message systems, in
// one run on two CPUs.
//
//   mpf::bench::Options options;
//   mpf::bench::addOptions(*bench.add_subcommand("local", mpf::bench::kLocalHelp), options);
//   ... return mpf::bench::runLocal(options);
#pragma once

#include "benchmarks/local/session.h"

namespace mpf::bench {

inline constexpr const char* kLocalHelp =
    "How fast messages are on this host, beside the physical floors and other message systems";

// Returns the exit status of a program: 0 all was measured or left out by name, 1 something failed,
// 2 the options cannot be met.
[[nodiscard]] int runLocal(const Options& options);

}  // namespace mpf::bench
