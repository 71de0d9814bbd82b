// SPDX-License-Identifier: MIT
// `mpf bench epics`: records of an IOC that talk to a server in another process, beside soft
// records, a bare SyncClient, and the manual's figure ("Performance").
//
//   server ◄── messages ── IOC (this program; its records are processed as fast as they complete)
//   server's CPUs          requester's CPUs
//
// Threads  as in session.h; the IOC runs in the process of the requester.
#pragma once

#include <string>
#include <vector>

#include "benchmarks/local/session.h"

namespace mpf::bench {

struct EpicsOptions : Options {
  Mode wait = Mode::adaptive;  // of the server and of the bare client
  int kills = 500;             // of servers, in each row about them
};

inline constexpr const char* kEpicsHelp =
    "Measures records of an EPICS IOC that talk to a server in another process";

void addOptions(CLI::App& app, EpicsOptions& options);

// Returns the exit status of the program: 0 all rows were measured or left out with a reason, 1 a
// row failed, 2 usage error.
[[nodiscard]] int runEpics(const EpicsOptions& options);

struct EpicsBench {
  std::string backplane;  // unique on this host
  Mode wait = Mode::adaptive;
  int kills = 0;
};

// The rows of one source file each.
[[nodiscard]] std::vector<Measurement> recordRequestRows(const EpicsBench& bench);
[[nodiscard]] std::vector<Measurement> scannedRows(const EpicsBench& bench);
[[nodiscard]] std::vector<Measurement> subscriptionRows(const EpicsBench& bench);

[[nodiscard]] std::vector<Measurement> faultRows(const EpicsBench& bench);

[[nodiscard]] std::string epicsTable(const std::vector<Result>& results);
[[nodiscard]] std::string epicsGoals(const std::vector<Result>& results);

// Headings, and names that the table and the goals look for.
inline constexpr const char* kRecords = "Records that ask a server";
inline constexpr const char* kScanned = "10 000 records, SCAN \".1 second\"";
inline constexpr const char* kPushed = "A server that sends, records with SCAN \"I/O Intr\"";
inline constexpr const char* kBareClient = "SyncClient, no record";
inline constexpr const char* kOneRecord = "1 record at a time";
inline constexpr const char* kThousand = "1000 records";
inline constexpr const char* kFaults = "1000 records, SCAN \".1 second\", on 50 servers";
inline constexpr const char* kDeath = "from a kill until 20 records are INVALID";
inline constexpr const char* kReturn = "from a restart until 20 records are valid";
inline constexpr const char* kStopped = "change of any scan rate while one server is stopped";
inline constexpr const char* kIocCpu = "CPU of the IOC";

}  // namespace mpf::bench
