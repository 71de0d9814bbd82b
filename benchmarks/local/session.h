// SPDX-License-Identifier: MIT
// What `mpf bench local`, `remote` and `hardware` have in common: the choice of rows and CPUs, the
// measurements one after another, and the output.
//
// Progress goes to stderr, the table to stdout, JSON to a file.
//
// Threads  the calling process must have no other thread, because these functions fork.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "benchmarks/stage/machine.h"
#include "benchmarks/stage/measurement.h"

namespace CLI {  // NOLINT(readability-identifier-naming): a library's name
class App;
class Option;
}  // namespace CLI

namespace mpf::bench {

struct Options {
  bool quick = false;    // ends within 40 s, `mpf bench local` with all peers within 90 s
  bool list = false;     // only lists the rows that would be measured
  std::string jsonFile;  // empty: none; "-": stdout instead of the table
  // Of server and requester: "0", or several as "0+2"; empty: the first two allowed.
  std::vector<std::string> cpus;
  // Measures only rows whose full name contains one of these, and the floors that they need.
  std::vector<std::string> only;
  std::string commandLine;  // for the head of the table
};

// Adds --quick, --list, --json, --cpus and --only.
void addOptions(CLI::App& app, Options& options);
// Adds --wait.
CLI::Option* addWaitOption(CLI::App& app, Mode& wait);

// The duration of the rows, and the number of rounds of each row.
struct Pace {
  Nanoseconds fullRow{};
  Nanoseconds quickRun{};  // of all rows together in a quick run, without the time to set up
  std::function<int(const Measurement&)> rounds;
  bool sharesFloors = false;  // successive rows of one question are a block; see Runner
  std::optional<Measurement> line{};  // see Runner
};

// The rows that the user asked for, and their floors.
[[nodiscard]] std::vector<Measurement> choose(std::vector<Measurement> all, const Options& options);

// The CPUs of both sides. nullopt, after it has printed the reason, when the options cannot be met.
// With --list, the CPUs are not checked.
//   mayShare  both sides may be on one CPU
[[nodiscard]] std::optional<Placement> place(const Options& options, bool mayShare);

// Measures all rows, in order.
[[nodiscard]] std::vector<Result> takeAll(const std::vector<Measurement>& rows,
                                          const Placement& placement, const Options& options,
                                          const Pace& pace);

// A whole run: lists the chosen rows, or measures them and prints `tableOf` of the results.
//   placement  the result of place()
//   returns    the exit status of the program: 0 all rows were measured or left out with a reason,
//              1 a row failed, 2 usage error
[[nodiscard]] int run(std::vector<Measurement> all, const std::optional<Placement>& placement,
                      const Options& options, const Pace& pace,
                      const std::function<std::string(const std::vector<Result>&)>& tableOf);

}  // namespace mpf::bench
