// SPDX-License-Identifier: MIT
// Session: what `mpf bench local`, `remote` and `hardware` have in common: which rows, on which
// CPUs, one after another, and what to show.
//
// Progress goes to stderr, the table to stdout, JSON to a file.
//
// Threads  call it from a process that has no other thread: it forks.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "benchmarks/stage/machine.h"
#include "benchmarks/stage/measurement.h"

namespace CLI {  // NOLINT(readability-identifier-naming): a library's name
class App;
}

namespace mpf::bench {

struct Options {
  bool quick = false;  // within 40 s
  bool list = false;  // only name what would be measured
  std::string jsonFile;  // empty: none; "-": stdout instead of the table
  std::vector<std::string>
      cpus;  // server's and requester's: "0", or several as "0+2"; empty: the first two allowed
  // rows whose full name contains one of these, and the floors that they need
  std::vector<std::string> only;
  std::string commandLine;  // for the table's head
};

// Adds --quick, --list, --json, --cpus and --only.
void addOptions(CLI::App& app, Options& options);
// Adds --wait.
void addWaitOption(CLI::App& app, Mode& wait);

// How long rows take, and how often each is taken beside its floor.
struct Pace {
  Nanoseconds fullRow{};
  Nanoseconds quickRun{};  // all rows together, in a quick run; setting up comes on top
  std::function<int(const Measurement&)> rounds;
};

// What was asked for, and the floors that it is divided by.
[[nodiscard]] std::vector<Measurement> choose(std::vector<Measurement> all, const Options& options);

// Where both sides run. nullopt, and says why, when the options cannot be met; nowhere when there
// is only a list to print.
//   mayShare  both sides may be on one CPU
[[nodiscard]] std::optional<Placement> place(const Options& options, bool mayShare);

// Takes all rows, in order.
[[nodiscard]] std::vector<Result> takeAll(const std::vector<Measurement>& rows,
                                          const Placement& placement, const Options& options,
                                          const Pace& pace);

// A whole run: lists the rows that are asked for, or takes them and shows `tableOf` them.
//   placement  as place() says
//   returns    the exit status of a program: 0 all was measured or left out by name, 1 something
//              failed, 2 the options cannot be met
[[nodiscard]] int run(std::vector<Measurement> all, const std::optional<Placement>& placement,
                      const Options& options, const Pace& pace,
                      const std::function<std::string(const std::vector<Result>&)>& tableOf);

}  // namespace mpf::bench
