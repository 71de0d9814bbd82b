// SPDX-License-Identifier: MIT
// mpf torture: stops and kills clients and servers at each step, and checks that everything that
// MPF promises holds.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <stdexcept>

#include "base/command_line.h"
#include "base/output_file.h"
#include "base/print_error.h"
#include "tools/arguments.h"
#include "tools/commands.h"
#include "tools/text/json_text.h"
#include "tools/torture/campaign.h"

namespace mpf::tools {
namespace {

struct Arguments {
  torture::CampaignOptions campaign;
  double seconds = 60;
  double patience = 30;
  std::string everyInstruction;
  std::string json;
  bool list = false;
};

const std::map<std::string, torture::Role> kRoles{{"client", torture::Role::client},
                                                  {"server", torture::Role::server}};
const std::map<std::string, torture::Mode> kModes{{"kill", torture::Mode::kill},
                                                  {"stop", torture::Mode::stop}};
const std::map<std::string, torture::Sabotage> kSabotages{
    {"lose-fate", torture::Sabotage::loseFate},
    {"half-message", torture::Sabotage::halfMessage},
    {"keep-name", torture::Sabotage::keepName},
    {"stale", torture::Sabotage::stale},
    {"leak", torture::Sabotage::leak}};

// An option whose value is one of the names in `choices`.
template <class Value, class Choice>
CLI::Option* addChoice(CLI::App& command, const std::string& name, Value& value,
                       const std::map<std::string, Choice>& choices, const std::string& text) {
  return command
      .add_option_function<std::string>(
          name, [&value, &choices](const std::string& chosen) { value = choices.at(chosen); }, text)
      ->check(CLI::IsMember(choices));
}

int list(const torture::Marks& marks) {
  for (const auto& [mark, addresses] : marks.byName()) fmt::print("{}\n", mark);
  return 0;
}

void checkSteps(const torture::Marks& marks, const std::vector<std::string>& steps) {
  for (const auto& step : steps) {
    if (!marks.contains(step))
      throw std::invalid_argument(
          fmt::format("no step \"{}\"; `mpf torture --list` lists all", step));
  }
}

// Shows the current round on a terminal, in a line that each round overwrites.
torture::Campaign::Progress progress() {
  if (::isatty(STDERR_FILENO) == 0) return [](const auto&...) {};
  return [](const torture::Plan& plan, std::uint64_t round, std::uint64_t planned) {
    const auto of = planned == 0 ? std::string() : fmt::format(" of {}", planned);
    writeError(fmt::format("\r\x1b[Kround {}{}: {} {} at {} + {}", round, of, toString(plan.mode),
                           toString(plan.role), plan.place.mark, plan.place.instructions));
  };
}

// Opens the file for the verdict before the work, which may take hours; nullopt without a path.
std::optional<OutputFile> openVerdict(const std::string& path) {
  if (path.empty()) return std::nullopt;
  return OutputFile(path);
}

int run(const Arguments& arguments) {
  const auto marks = torture::Marks::ofThisProgram();
  if (arguments.list) return list(marks);
  auto options = arguments.campaign;
  if (!arguments.everyInstruction.empty()) options.steps = {arguments.everyInstruction};
  options.everyInstruction = !arguments.everyInstruction.empty();
  options.duration = std::chrono::duration<double>(arguments.seconds);
  options.referee.patience = std::chrono::duration<double>(arguments.patience);
  checkSteps(marks, options.steps);
  auto verdict = openVerdict(arguments.json);
  const auto tally = torture::Campaign(marks, options, progress()).run();
  if (::isatty(STDERR_FILENO) != 0) writeError("\r\x1b[K");
  fmt::print("{}", tally.text());
  if (verdict) {
    verdict->write(jsonText(tally.json()) + '\n');
    verdict->close();
  }
  return tally.verdict() == "held" ? 0 : 1;
}

}  // namespace

void addTorture(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand(
      "torture",
      "Kills clients and servers at each step, and checks that all other processes continue");
  auto arguments = std::make_shared<Arguments>();
  auto& options = arguments->campaign;
  options.referee.seed = std::random_device()();
  addSeconds(command, "--duration", arguments->seconds,
             "Time for random places, after one round for each step", true);
  command
      .add_option("--seed", options.referee.seed,
                  "Seed of the random numbers; it is printed at the end")
      ->check(wholeNumber(0));
  command.add_flag("--list", arguments->list, "Lists the steps, and does nothing else");
  command.add_option("--step", options.steps, "Only this step; may be given several times");
  addChoice(command, "--role", options.role, kRoles, "Only clients, or only servers");
  addChoice(command, "--mode", options.mode, kModes, "Only kill, or only stop for a while");
  command.add_option("--hit", options.hit, "Number of the visit to the step, from 1")
      ->check(wholeNumber(1));
  command
      .add_option("--instructions", options.instructions,
                  "Number of instructions to execute after the step")
      ->check(wholeNumber(0));
  command.add_option("--every-instruction", arguments->everyInstruction,
                     "A round for each instruction from this step to the next one");
  addSeconds(command, "--patience", arguments->patience,
             "Longest wait for a condition that must become true", false);
  command.add_option("--json", arguments->json, "Also writes the verdict to this file, as JSON")
      ->type_name("FILE");
  addChoice(command, "--break", options.referee.sabotage, kSabotages, "")->group("");
  command.callback([arguments, &run] { run = [arguments] { return tools::run(*arguments); }; });
}

}  // namespace mpf::tools
