// SPDX-License-Identifier: MIT
// `mpf bench remote`: measures messages that go through a pair of routers beside what TCP alone
// does, on loopback and across two network namespaces. The manual's table ("Performance"), and what
// it did not ask: large arrays, 10 000 clients, idle routers.
//
// Threads  as Session.
#pragma once

#include <string>
#include <vector>

#include "benchmarks/local/session.h"
#include "benchmarks/remote/surroundings.h"

namespace mpf::bench {

inline constexpr const char* kRemoteHelp =
    "How fast messages are between hosts, beside raw TCP: on loopback and across two network "
    "namespaces";

inline constexpr int kCrowd = 10'000;  // clients that the goal asks for

struct RemoteOptions : Options {
  Mode wait = Mode::adaptive;  // of servers and clients of ours
  int clients = kCrowd;  // in the rows about many
};

// Adds --wait and --clients to the usual ones.
void addOptions(CLI::App& app, RemoteOptions& options);

// Returns the exit status of a program: 0 all was measured or left out by name, 1 something failed,
// 2 the options cannot be met.
[[nodiscard]] int runRemote(const RemoteOptions& options);

// Where rows are taken, and by which routers.
struct Place {
  std::string setting;  // "loopback"; in JSON
  std::string title;  // begins the headings of the table
  Surroundings between;
  std::string skipped;  // why nothing can be taken there
  std::string skippedRouters;  // why only rows without routers can
  std::shared_ptr<class RouterPair> routers;
  Mode wait = Mode::adaptive;
  int clients = kCrowd;
  std::string runName;  // unique on this host: begins names of backplanes
};

// The rows of one source file each. Ratios are to raw TCP at the same place.
[[nodiscard]] std::vector<Measurement> messageRows(const Place& place, bool withLocal);
[[nodiscard]] std::vector<Measurement> arrayRows(const Place& place);
[[nodiscard]] std::vector<Measurement> crowdRows(const Place& place);
[[nodiscard]] std::vector<Measurement> idleRows(const Place& place);

// A row of this place; `routed` ones have its routers around them.
[[nodiscard]] Measurement rowAt(const Place& place, const std::string& question,
                                const std::string& name, bool routed);

// The table, and the goals under it.
[[nodiscard]] std::string remoteTable(const std::vector<Result>& results);
[[nodiscard]] std::string remoteGoals(const std::vector<Result>& results);

// How headings begin: the titles of places.
inline constexpr const char* kLoopback = "One host, loopback";
inline constexpr const char* kNamespaces = "Two network namespaces, veth";
// How headings go on after the title of the place, and names that the goals look for.
inline constexpr const char* kMessages = ": round trips of an Int32";
inline constexpr const char* kArrays = ": arrays of 1 MiB there and back";
inline constexpr const char* kClients = ": many clients through one pair of routers";
inline constexpr const char* kIdle = ": an idle pair of routers with one client";

}  // namespace mpf::bench
