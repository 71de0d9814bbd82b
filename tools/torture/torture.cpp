// SPDX-License-Identifier: MIT
// mpf torture: stops and kills clients and servers at each step of their lives, and looks whether everything that MPF promises holds.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fstream>
#include <map>
#include <memory>
#include <random>
#include <stdexcept>

#include <mpf/tools/arguments.h>
#include <mpf/tools/commands.h>
#include <mpf/tools/torture/campaign.h>

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

const std::map<std::string, torture::Role> kRoles{{"client", torture::Role::client}, {"server", torture::Role::server}};
const std::map<std::string, torture::Mode> kModes{{"kill", torture::Mode::kill}, {"stop", torture::Mode::stop}};
const std::map<std::string, torture::Sabotage> kSabotages{{"lose-fate", torture::Sabotage::loseFate},
                                                          {"half-message", torture::Sabotage::halfMessage},
                                                          {"keep-name", torture::Sabotage::keepName},
                                                          {"stale", torture::Sabotage::stale},
                                                          {"leak", torture::Sabotage::leak}};

int list(const torture::Marks& marks) {
  for (const auto& [mark, addresses] : marks.byName()) fmt::print("{}\n", mark);
  return 0;
}

void checkSteps(const torture::Marks& marks, const std::vector<std::string>& steps) {
  for (const auto& step : steps) {
    if (!marks.contains(step)) throw std::invalid_argument(fmt::format("no step \"{}\"; `mpf torture --list` names all", step));
  }
}

// A line that is written over, on a terminal.
torture::Campaign::Progress progress() {
  if (::isatty(STDERR_FILENO) == 0) return [](const auto&...) {};
  return [](const torture::Plan& plan, std::uint64_t round, std::uint64_t planned) {
    const auto of = planned == 0 ? std::string() : fmt::format(" of {}", planned);
    fmt::print(stderr, "\r\x1b[Kround {}{}: {} {} at {} + {}", round, of, toString(plan.mode), toString(plan.role), plan.place.mark,
               plan.place.instructions);
  };
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
  const auto tally = torture::Campaign(marks, options, progress()).run();
  if (::isatty(STDERR_FILENO) != 0) fmt::print(stderr, "\r\x1b[K");
  fmt::print("{}", tally.text());
  if (!arguments.json.empty()) {
    std::ofstream file(arguments.json);
    file << tally.json().dump(2) << '\n';
    if (!file.flush()) throw std::runtime_error(fmt::format("cannot write {}", arguments.json));
  }
  return tally.verdict() == "held" ? 0 : 1;
}

}  // namespace

void addTorture(CLI::App& app, Run& run) {
  auto& command =
      *app.add_subcommand("torture", "Kills clients and servers at each step of their lives, and looks whether all others go on");
  auto arguments = std::make_shared<Arguments>();
  auto& options = arguments->campaign;
  options.referee.seed = std::random_device()();
  addSeconds(command, "--duration", arguments->seconds, "Time for random places, after each step had its turn", true);
  command.add_option("--seed", options.referee.seed, "Of what is random; it is printed at the end");
  command.add_flag("--list", arguments->list, "Names the steps, and does nothing");
  command.add_option("--step", options.steps, "Only this step; may be given several times");
  command.add_option("--role", options.role, "Only clients, or only servers")->transform(CLI::CheckedTransformer(kRoles));
  command.add_option("--mode", options.mode, "Only kill, or only stop for a while")->transform(CLI::CheckedTransformer(kModes));
  command.add_option("--hit", options.hit, "The how-many-th time that the process comes to the step")->check(CLI::PositiveNumber);
  command.add_option("--instructions", options.instructions, "So many instructions behind the step")->check(CLI::NonNegativeNumber);
  command.add_option("--every-instruction", arguments->everyInstruction, "At each instruction from this step to the next one");
  addSeconds(command, "--patience", arguments->patience, "Longest wait for what must come true", false);
  command.add_option("--json", arguments->json, "Writes the verdict into this file, too: JSON")->type_name("FILE");
  command.add_option("--break", options.referee.sabotage)->transform(CLI::CheckedTransformer(kSabotages))->group("");
  command.callback([arguments, &run] { run = [arguments] { return tools::run(*arguments); }; });
}

}  // namespace mpf::tools
