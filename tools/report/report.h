// SPDX-License-Identifier: MIT
// Report: what ls, mrr and msr have in common: which backplanes, between which two looks, for
// people or for programs.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "tools/report/snapshot_delta.h"

namespace mpf::tools {

struct ReportArguments {
  std::string backplane;
  int intervalMs = 200;
  bool json = false;
};
// Adds --backplane, --interval and --json.
void addReport(CLI::App& app, ReportArguments& arguments);

inline constexpr const char* kNoBackplane = "no backplane: no program uses MPF on this host\n";

// The name of a server, and its location unless that is 0: "dac", "dac@2".
std::string serverText(const std::string& server, std::int32_t location);

// Looks at the backplane named, by argument or by MPF_BACKPLANE, or else at each that there is, and
// prints each look, or all as one JSON list.
//   collect   adds to the list
//   returns   how many backplanes there were
int reportEach(const ReportArguments& arguments,
               const std::function<void(const SnapshotDelta&)>& print,
               const std::function<void(const SnapshotDelta&, nlohmann::json& list)>& collect);

}  // namespace mpf::tools
