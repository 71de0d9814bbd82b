// SPDX-License-Identifier: MIT
#include "tools/report/report.h"

#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <mpf/backplane.h>

#include "base/command_line.h"
#include "shm/segment.h"
#include "shm/segment_name.h"
#include "tools/arguments.h"
#include "tools/text/json_text.h"

namespace mpf::tools {
namespace {

bool isWindowOfProcess(const std::string& segment) {
  const auto parsed = SegmentName::tryParse(segment);
  return parsed &&
         (parsed->kind == NameKind::serverWindow || parsed->kind == NameKind::clientWindow) &&
         segments::probeOwner(segment) == segments::Owner::alive;
}

// The end of a sentence about a backplane that does not exist; empty when no other has a process.
std::string advice(std::vector<std::string> backplanes) {
  std::erase_if(backplanes, [](const auto& name) {
    return std::ranges::none_of(Backplane::named(name).segmentNames(), isWindowOfProcess);
  });
  return backplanes.empty() ? "" : fmt::format("; use one of {}", fmt::join(backplanes, ", "));
}

}  // namespace

void addReport(CLI::App& app, ReportArguments& arguments) {
  addBackplane(app, arguments.backplane, "all backplanes");
  addTime(app, "--interval", arguments.interval,
          "Time between the two snapshots from which rates and stalls are found",
          {.least = std::chrono::milliseconds(1), .most = std::chrono::hours(1)});
  addJson(app, arguments.json);
}

std::string serverText(const std::string& server, std::int32_t location) {
  return location == 0 ? server : fmt::format("{}@{}", server, location);
}

int reportEach(const ReportArguments& arguments,
               const std::function<void(const SnapshotDelta&)>& print,
               const std::function<void(const SnapshotDelta&, nlohmann::json& list)>& collect) {
  auto list = nlohmann::json::array();
  const auto backplanes = arguments.backplane.empty()
                              ? Backplane::names()
                              : std::vector{Backplane::named(arguments.backplane).name()};
  const auto all = Backplane::names();
  for (const auto& backplane : backplanes) {
    if (!arguments.json && std::ranges::find(all, backplane) == all.end()) {
      fmt::print("backplane {} has no process{}\n", backplane, advice(all));
      continue;
    }
    const SnapshotDelta delta(backplane, arguments.interval);
    if (arguments.json) collect(delta, list);
    else print(delta);
  }
  if (arguments.json) fmt::print("{}\n", jsonText(list));
  return static_cast<int>(backplanes.size());
}

}  // namespace mpf::tools
