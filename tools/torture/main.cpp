// SPDX-License-Identifier: MIT
// mpf-torture: the program that `mpf torture` executes. It stops and kills clients and servers at
// each step, and checks that everything that MPF promises holds.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <map>
#include <optional>
#include <random>
#include <stdexcept>

#include "base/command_line.h"
#include "base/output_file.h"
#include "base/print_error.h"
#include "base/run_main.h"
#include "tools/text/json_text.h"
#include "tools/torture/campaign.h"

namespace mpf::torture {
namespace {

struct Arguments {
  CampaignOptions campaign;
  std::string everyInstruction;
  std::string json;
  bool list = false;
};

const std::map<std::string, Role> kRoles{{"client", Role::client}, {"server", Role::server}};
const std::map<std::string, Mode> kModes{{"kill", Mode::kill}, {"stop", Mode::stop}};
const std::map<std::string, Sabotage> kSabotages{{"lose-fate", Sabotage::loseFate},
                                                 {"half-message", Sabotage::halfMessage},
                                                 {"keep-name", Sabotage::keepName},
                                                 {"stale", Sabotage::stale},
                                                 {"leak", Sabotage::leak}};

// An option whose value is one of the names in `choices`.
template <class Value, class Choice>
CLI::Option* addChoice(CLI::App& command, const std::string& name, Value& value,
                       const std::map<std::string, Choice>& choices, const std::string& text) {
  return command
      .add_option_function<std::string>(
          name, [&value, &choices](const std::string& chosen) { value = choices.at(chosen); }, text)
      ->check(CLI::IsMember(choices));
}

int list(const Marks& marks) {
  for (const auto& [mark, addresses] : marks.byName()) fmt::print("{}\n", mark);
  return 0;
}

void checkSteps(const Marks& marks, const std::vector<std::string>& steps) {
  for (const auto& step : steps) {
    if (!marks.contains(step))
      throw std::invalid_argument(
          fmt::format("no step \"{}\"; `mpf torture --list` lists all", step));
  }
}

// Shows the current round on a terminal, in a line that each round overwrites.
Campaign::Progress progress() {
  if (::isatty(STDERR_FILENO) == 0) return [](const auto&...) {};
  return [](const Plan& plan, std::uint64_t round, std::uint64_t planned) {
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
  const auto marks = Marks::ofThisProgram();
  if (arguments.list) return list(marks);
  auto options = arguments.campaign;
  if (!arguments.everyInstruction.empty()) options.steps = {arguments.everyInstruction};
  options.everyInstruction = !arguments.everyInstruction.empty();
  checkSteps(marks, options.steps);
  auto verdict = openVerdict(arguments.json);
  const auto tally = Campaign(marks, options, progress()).run();
  if (::isatty(STDERR_FILENO) != 0) writeError("\r\x1b[K");
  fmt::print("{}", tally.text());
  if (verdict) {
    verdict->write(tools::jsonText(tally.json()) + '\n');
    verdict->close();
  }
  return tally.verdict() == "held" ? 0 : 1;
}

void addOptions(CLI::App& command, Arguments& arguments) {
  auto& options = arguments.campaign;
  options.referee.seed = std::random_device()();
  addTime(command, "--duration", options.duration,
          "Time for random places, after each step was tested once");
  command
      .add_option("--seed", options.referee.seed,
                  "Seed of the random numbers; it is printed at the end")
      ->check(wholeNumber(0));
  command.add_flag("--list", arguments.list, "Lists the steps, and does nothing else");
  command.add_option("--step", options.steps, "Only this step; may be given several times");
  addChoice(command, "--role", options.role, kRoles, "Only clients, or only servers");
  addChoice(command, "--mode", options.mode, kModes, "Only kill, or only stop for a while");
  command.add_option("--hit", options.hit, "Which visit to the step, from 1")
      ->check(wholeNumber(1));
  command
      .add_option("--instructions", options.instructions,
                  "Number of instructions to execute after the step")
      ->check(wholeNumber(0));
  command.add_option("--every-instruction", arguments.everyInstruction,
                     "A round for each instruction from this step to the next one");
  addTime(command, "--patience", options.referee.patience,
          "Longest wait for a condition that must become true", kAboveZero);
  command.add_option("--json", arguments.json, "Also writes the verdict to this file, as JSON")
      ->type_name("FILE");
  addChoice(command, "--break", options.referee.sabotage, kSabotages, "")->group("");
}

int torture(int argc, char** argv) {
  CLI::App app(
      "mpf torture - kills clients and servers at each step, and checks that all other processes "
      "continue",
      "mpf torture");
  Arguments arguments;
  addOptions(app, arguments);
  if (const auto status = parseCommandLine(app, argc, argv)) return *status;
  return run(arguments);
}

}  // namespace
}  // namespace mpf::torture

int main(int argc, char** argv) {
  return mpf::runMain("mpf torture", [&] { return mpf::torture::torture(argc, argv); });
}
