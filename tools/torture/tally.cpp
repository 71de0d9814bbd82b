// SPDX-License-Identifier: MIT
#include "tools/torture/tally.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "tools/text/table.h"

namespace mpf::torture {
namespace {

bool isReached(const Played& played) {
  for (const auto& ofRole : played) {
    if (ofRole[0] + ofRole[1] != 0) return true;
  }
  return false;
}

std::string count(std::uint64_t number) { return number == 0 ? "-" : fmt::format("{}", number); }

std::string tableOf(const std::map<std::string, Played>& marks) {
  tools::Table table({"STEP", ">CLIENT KILLED", ">STOPPED", ">SERVER KILLED", ">STOPPED"});
  for (const auto& [mark, played] : marks) {
    table.add(
        {mark, count(played[0][0]), count(played[0][1]), count(played[1][0]), count(played[1][1])});
  }
  return table.text();
}

nlohmann::json jsonOf(const Plan& plan) {
  return {{"role", toString(plan.role)},
          {"mode", toString(plan.mode)},
          {"step", plan.place.mark},
          {"hit", plan.place.hit},
          {"instructions", plan.place.instructions}};
}

}  // namespace

std::string commandOf(const Plan& plan) {
  return fmt::format("mpf torture --role {} --mode {} --step {} --hit {} --instructions {}",
                     toString(plan.role), toString(plan.mode), plan.place.mark, plan.place.hit,
                     plan.place.instructions);
}

std::vector<std::string> Tally::neverReached() const {
  std::vector<std::string> names;
  for (const auto& [mark, played] : marks) {
    if (!isReached(played)) names.push_back(mark);
  }
  return names;
}

std::string Tally::verdict() const {
  if (failure) return "failed";
  return neverReached().empty() ? "held" : "incomplete";
}

std::string Tally::text() const {
  auto text = tableOf(marks);
  if (const auto names = neverReached(); !failure && !names.empty())
    text += fmt::format("never reached: {}\n", fmt::join(names, ", "));
  if (!holdings.empty()) text += holdings + "\n";
  text += fmt::format("{}: {} rounds in {:.1f} s, seed {}\n", verdict(), rounds, seconds, seed);
  if (failure) text += fmt::format("{}\n", failure->what);
  if (failure && failure->plan) text += fmt::format("again: {}\n", commandOf(*failure->plan));
  return text;
}

nlohmann::json Tally::json() const {
  auto steps = nlohmann::json::array();
  for (const auto& [mark, played] : marks) {
    steps.push_back({{"step", mark},
                     {"client", {{"killed", played[0][0]}, {"stopped", played[0][1]}}},
                     {"server", {{"killed", played[1][0]}, {"stopped", played[1][1]}}}});
  }
  nlohmann::json json{{"verdict", verdict()},      {"seed", seed},
                      {"rounds", rounds},          {"seconds", seconds},
                      {"steps", std::move(steps)}, {"never_reached", neverReached()}};
  if (failure) json["failure"] = {{"what", failure->what}};
  if (failure && failure->plan) json["failure"].update(jsonOf(*failure->plan));
  return json;
}

}  // namespace mpf::torture
