// SPDX-License-Identifier: MIT
// `mpf bench local`: measures ours beside the physical floors and beside other message systems, in one run on two CPUs.
//
//   auto options = std::make_shared<mpf::bench::LocalOptions>();
//   mpf::bench::addOptions(*bench.add_subcommand("local", mpf::bench::kLocalHelp), *options);
//   ... return mpf::bench::runLocal(*options);
//
// Progress goes to stderr, the table to stdout, JSON to a file.
//
// Threads  call it from a process that has no other thread: it forks.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace CLI {  // NOLINT(readability-identifier-naming): a library's name
class App;
}

namespace mpf::bench {

inline constexpr const char* kLocalHelp = "How fast messages are on this host, beside the physical floors and other message systems";

struct LocalOptions {
  bool quick = false;              // within 40 s
  bool list = false;               // only name what would be measured
  std::string jsonFile;            // empty: none; "-": stdout instead of the table
  std::vector<int> cpus;           // server's and requester's; empty: the first two allowed
  std::vector<std::string> only;   // rows whose question, name or mode contains one of these, and the floors that they need
  std::string commandLine;         // for the table's head
};

// Adds --quick, --list, --json, --cpus and --only.
void addOptions(CLI::App& app, LocalOptions& options);

// Returns the exit status of a program: 0 all was measured or left out by name, 1 something failed, 2 the options cannot be met.
[[nodiscard]] int runLocal(const LocalOptions& options);

}  // namespace mpf::bench
