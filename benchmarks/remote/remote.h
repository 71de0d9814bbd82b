// SPDX-License-Identifier: MIT
// `mpf bench remote`: measures messages through a pair of routers beside raw TCP, on loopback and
// across two network namespaces: the manual's table ("Performance"), and large arrays, 10 000
// clients, idle routers.
//
// Threads  as in session.h.
#pragma once

#include <string>
#include <vector>

#include "benchmarks/local/session.h"
#include "benchmarks/remote/surroundings.h"

namespace mpf::bench {

inline constexpr const char* kRemoteHelp =
    "Measures messages between hosts, beside raw TCP: on loopback and across two network "
    "namespaces";

inline constexpr int kCrowd = 10'000;  // number of clients in the goal

struct RemoteOptions : Options {
  Mode wait = Mode::adaptive;  // of MPF servers and clients
  int clients = kCrowd;        // in the rows about many clients
};

// Adds --wait and --clients to the usual ones.
void addOptions(CLI::App& app, RemoteOptions& options);

// Returns the exit status of the program: 0 all rows were measured or left out with a reason, 1 a
// row failed, 2 usage error.
[[nodiscard]] int runRemote(const RemoteOptions& options);

// The surroundings in which rows are measured, and the routers.
struct Place {
  std::string setting;  // in JSON: "loopback"
  std::string title;    // the headings of the table begin with it
  Surroundings between;
  std::string skipped;         // why no row can be measured there
  std::string skippedRouters;  // why rows with routers cannot be measured there
  std::shared_ptr<class RouterPair> routers;
  Mode wait = Mode::adaptive;
  int clients = kCrowd;
  std::string runName;  // unique on this host; the names of backplanes begin with it
};

// The rows of one source file each. The floor of a row is raw TCP at the same place.
[[nodiscard]] std::vector<Measurement> messageRows(const Place& place, bool withLocal);
[[nodiscard]] std::vector<Measurement> arrayRows(const Place& place);
[[nodiscard]] std::vector<Measurement> crowdRows(const Place& place);
[[nodiscard]] std::vector<Measurement> idleRows(const Place& place);

// A row of this place. A `routed` row runs with the routers of the place.
[[nodiscard]] Measurement rowAt(const Place& place, const std::string& question,
                                const std::string& name, bool routed);

// The table, and the goals that follow it.
[[nodiscard]] std::string remoteTable(const std::vector<Result>& results);
[[nodiscard]] std::string remoteGoals(const std::vector<Result>& results);

// The titles of places, with which headings begin.
inline constexpr const char* kLoopback = "One host, loopback";
inline constexpr const char* kNamespaces = "Two network namespaces, veth";
// The rest of the headings, which the goals also use.
inline constexpr const char* kMessages = ": round trips of an Int32";
inline constexpr const char* kArrays = ": round trips of arrays of 1 MiB";
inline constexpr const char* kClients = ": many clients through one pair of routers";
inline constexpr const char* kIdle = ": an idle pair of routers with one client";

}  // namespace mpf::bench
