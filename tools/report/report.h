// SPDX-License-Identifier: MIT
// What ls, mrr and msr have in common: the choice of backplanes, two snapshots of each, and output
// as text or as JSON.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include <mpf/clock.h>

#include "tools/report/snapshot_delta.h"

namespace mpf::tools {

struct ReportArguments {
  std::string backplane;
  Nanoseconds interval = std::chrono::milliseconds(200);
  bool json = false;
};
// Adds --backplane, --interval and --json.
void addReport(CLI::App& app, ReportArguments& arguments);

inline constexpr const char* kNoBackplane = "no backplane: no program uses MPF on this host\n";

// The name of a server, and its location unless that is 0: "dac", "dac@2".
std::string serverText(const std::string& server, std::int32_t location);

// Takes two snapshots of the backplane that the argument or MPF_BACKPLANE names, or of each
// backplane of the host, and prints each as text, or all as one JSON list.
//   print     prints one backplane as text
//   collect   adds one backplane to the JSON list
//   returns   number of backplanes
int reportEach(const ReportArguments& arguments,
               const std::function<void(const SnapshotDelta&)>& print,
               const std::function<void(const SnapshotDelta&, nlohmann::json& list)>& collect);

}  // namespace mpf::tools
