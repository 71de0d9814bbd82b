// SPDX-License-Identifier: MIT
// mpf doctor: what on this host would hurt, and what helps.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <fmt/format.h>
#include <memory>
#include <nlohmann/json.hpp>

#include <mpf/tools/arguments.h>
#include <mpf/tools/check_up.h>
#include <mpf/tools/commands.h>
#include <mpf/tools/json_text.h>
#include <mpf/tools/wrap.h>

namespace mpf::tools {
namespace {

void print(const Finding& finding) {
  constexpr std::size_t kIndent = 9;
  fmt::print("{}", wrap(fmt::format("{:<8} ", toString(finding.health)), finding.check + ": " + finding.seen, kIndent));
  if (!finding.remedy.empty()) fmt::print("{}", wrap(std::string(kIndent, ' '), "remedy: " + finding.remedy, kIndent + 2));
}

nlohmann::json toJson(const std::vector<Finding>& findings) {
  auto list = nlohmann::json::array();
  for (const auto& finding : findings) {
    list.push_back({{"check", finding.check}, {"verdict", toString(finding.health)}, {"seen", finding.seen}, {"remedy", finding.remedy}});
  }
  return list;
}

int examine(bool json) {
  const auto findings = checkUp(Host());
  if (json) fmt::print("{}\n", jsonText(toJson(findings)));
  else
    for (const auto& finding : findings) print(finding);
  return std::ranges::any_of(findings, [](const Finding& finding) { return finding.health == Health::problem; }) ? 1 : 0;
}

}  // namespace

void addDoctor(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand("doctor", "What on this host would hurt, and what helps");
  auto json = std::make_shared<bool>(false);
  addJson(command, *json);
  command.footer("Exit status: 0 no problem, though maybe warnings; 1 a problem.");
  command.callback([json, &run] { run = [json] { return examine(*json); }; });
}

}  // namespace mpf::tools
