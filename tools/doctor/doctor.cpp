// SPDX-License-Identifier: MIT
// mpf doctor: finds settings of this host that make MPF fail or slow it, and names remedies.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <fmt/format.h>
#include <memory>
#include <nlohmann/json.hpp>

#include "tools/arguments.h"
#include "tools/commands.h"
#include "tools/doctor/checks.h"
#include "tools/text/json_text.h"
#include "tools/text/wrap.h"

namespace mpf::tools {
namespace {

void print(const Finding& finding) {
  constexpr std::size_t kIndent = 9;
  fmt::print("{}", wrap(fmt::format("{:<8} ", toString(finding.health)),
                        finding.check + ": " + finding.seen, kIndent));
  if (!finding.remedy.empty())
    fmt::print("{}", wrap(std::string(kIndent, ' '), "remedy: " + finding.remedy, kIndent + 2));
}

nlohmann::json toJson(const std::vector<Finding>& findings) {
  auto list = nlohmann::json::array();
  for (const auto& finding : findings) {
    list.push_back({{"check", finding.check},
                    {"verdict", toString(finding.health)},
                    {"seen", finding.seen},
                    {"remedy", finding.remedy}});
  }
  return list;
}

int examine(bool asJson) {
  const auto findings = runDoctorChecks(Host());
  if (asJson) fmt::print("{}\n", jsonText(toJson(findings)));
  else
    for (const auto& finding : findings) print(finding);
  return std::ranges::any_of(
             findings, [](const Finding& finding) { return finding.health == Health::problem; })
             ? 1
             : 0;
}

}  // namespace

void addDoctor(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand(
      "doctor",
      "Finds settings of this host with which MPF fails or runs slowly, and prints remedies");
  auto json = std::make_shared<bool>(false);
  addJson(command, *json);
  command.footer("Exit status: 0 no problem (there may be warnings); 1 at least one problem.");
  command.callback([json, &run] { run = [json] { return examine(*json); }; });
}

}  // namespace mpf::tools
