// SPDX-License-Identifier: MIT
// ExternalPeer: a peer that is a program of its own, in any language. It measures itself, as the
// loops of timing.h do, and reports on its standard output.
//
//   Stage ── server's process ───── starts PROGRAM role=server ...      "ready"
//     └───── requester's process ── starts PROGRAM role=requester ...   "latency 310 77", ...
//
// The two processes of the Stage only read lines, asleep, and pin nothing but themselves: a program
// inherits the CPUs of its process. The protocol is in README.md, "Add a peer in another language".
//
// Threads  the runner's only thread.
// Crash    a program that fails or exceeds the time limit fails its own row. Both programs die with
//          the processes of the Stage; what they leave in /dev/shm and /tmp is removed.
// Trust    a line that is not part of the protocol is ignored, and shown if the program fails.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "benchmarks/peers/peer.h"

namespace mpf::bench {

struct ExternalProgram {
  std::vector<std::string> words;  // path or name of the program, and its first arguments
  Nanoseconds leastWarmUp{};  // for compilers that translate while the program runs
  Nanoseconds grace = std::chrono::seconds(15);  // as Workload::grace
};

struct ExternalTask {
  const char* work = "round-trips";  // or "outstanding", "one-way"
  int window = 1;  // number of requests outstanding
};

// Applies one line of a requester to the figures. Returns false if it is not such a line.
bool applyReport(std::string_view line, Figures& figures);

// The words after those of the program.
[[nodiscard]] std::vector<std::string> argumentsOf(const char* role, const ExternalTask& task,
                                                   const PeerOptions& options, Budget budget);

// Removes files of runs that were interrupted.
void removeFilesOfDeadRuns();

// Runs the two programs of one row.
[[nodiscard]] Outcome runExternal(const Stage& stage, const ExternalProgram& program,
                                  const ExternalTask& task, const PeerOptions& options);

}  // namespace mpf::bench
