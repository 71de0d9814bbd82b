// SPDX-License-Identifier: MIT
// mpf run: starts the processes of a crate file and supervises them. mpf new: writes a crate file.
#include <fcntl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <fmt/format.h>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

#include "base/output_file.h"
#include "crate/commands/commands.h"
#include "crate/commands/crate_source.h"
#include "crate/config/crate_schema.h"
#include "crate/config/process_plan.h"
#include "crate/config/read_crate.h"
#include "crate/supervisor/supervisor.h"
#include "tools/text/wrap.h"

namespace mpf::crate {
namespace {

struct RunArguments {
  CrateSource source;
  bool checkOnly = false;
  bool dryRun = false;
};

CrateFolder folderOf(const Crate& crate) { return CrateFolder::of(crate.name); }

void printPlans(const Crate& crate) {
  for (const auto& plan : planProcesses(crate, folderOf(crate).path().string()))
    fmt::print("# {}, in {}\n{}\n", plan.name, plan.workingFolder, shellText(plan));
}

// Prints what a startup file means, without starting anything.
Crate showStartup(const RunArguments& arguments) {
  auto startup = arguments.source.readStartup("ioc.cmd", false);
  printDiagnostics(startup.diagnostics, arguments.checkOnly);
  if (arguments.checkOnly)
    fmt::print("{} commands, {} of them skipped\n", startup.commands,
               startup.diagnostics.skipped());
  return std::move(startup.crate);
}

// Prints what the file means, without starting anything.
void show(const RunArguments& arguments) {
  const auto& source = arguments.source;
  const auto crate = source.isStartupFile() ? showStartup(arguments)
                     : arguments.checkOnly  ? source.check()
                                            : source.read();
  if (arguments.dryRun) printPlans(crate);
  else
    fmt::print("{}: {}, no error\n", source.file(),
               tools::counted(crate.processes.size(), "process", "processes"));
}

int runCrate(const RunArguments& arguments) {
  if (arguments.checkOnly || arguments.dryRun) {
    show(arguments);
    return 0;
  }
  if (arguments.source.isStartupFile())
    printDiagnostics(arguments.source.readStartup("", false).diagnostics, false);
  const auto crate = arguments.source.check();
  // What a startup file prepares is written only when the supervisor has locked the folder.
  auto first = arguments.source.isStartupFile() ? std::nullopt : std::optional(crate);
  const auto load = [source = arguments.source, first = std::move(first)]() mutable {
    return first ? *std::exchange(first, std::nullopt) : source.prepare();
  };
  Supervisor(folderOf(crate), load).run();
  return 0;
}

constexpr const char* kNewCrate =
    R"(# Crate {0}: processes that `mpf run {0}.toml` starts and supervises.
# It runs on device models, without hardware. `mpf run --check {0}.toml` checks the file.
#
#   mpf run {0}.toml                          starts everything; Ctrl-C stops it
#   mpf ps                                    the processes and their states
#   mpf call Int32 int32 value=7              a message to the first server

# backplane = "lab"                # default: $MPF_BACKPLANE, or "default"
# mode = "0660"                    # which users may be clients; default: this user
# group = "mpf"

[carriers]                         # boards that hold IndustryPack modules
ipac = "model"                     # a model; a real board: "tpci200"

[[server]]                         # sends each message back
program = "int32"
server = "Int32"

[[server]]                         # eight analog outputs
program = "dac128v"
module = "dac"
carrier = "ipac"
site = "IP_a"
queuesize = 20

[[server]]                         # sixteen analog inputs; input 0 measures output 0
program = "ip330"
module = "adc"
carrier = "ipac"
site = "IP_b"
type = "D"
signal = "0=wire:dac.0"

# [[server]]                       # an instrument on a serial line
# program = "serial"
# server = "dmm"
# port = "/dev/ttyS0"
# baud = 19200

# [[router]]                       # servers of this host, for other hosts at location 1
# serve = "1=0"
# listen = "127.0.0.1:9900"        # write the private address of this host
# plain = true                     # without TLS, which other addresses need

# [[ioc]]                          # EPICS records
# database = ["lab.db"]
# macros = "P=lab:"
# needs = ["dac", "adc"]
)";

// `name` may have folders in front, which do not belong to the name of the crate.
int writeNewCrate(const std::string& name) {
  if (const auto problem = problemOfName(std::filesystem::path(name).filename().string());
      !problem.empty())
    throw std::invalid_argument(problem);
  const auto file = name + ".toml";
  if (std::filesystem::exists(file))
    throw std::runtime_error(fmt::format("{} exists; choose another name, or remove it", file));
  OutputFile output(file);
  output.write(fmt::format(fmt::runtime(kNewCrate), name));
  output.close();
  fmt::print("{} is written; start it with: mpf run {}\n", file, file);
  return 0;
}

}  // namespace

void addRun(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand(
      "run",
      "Starts the servers, routers and IOCs of a crate file or startup file, and restarts those "
      "that fail");
  auto arguments = std::make_shared<RunArguments>();
  arguments->source.addOptions(command);
  auto* const check = command.add_flag("--check", arguments->checkOnly,
                                       "Only check the file, and print all errors");
  command.add_flag("--dry-run", arguments->dryRun, "Only print the command lines")->excludes(check);
  command.callback([arguments, &run] { run = [arguments] { return runCrate(*arguments); }; });
}

void addNew(CLI::App& app, Run& run) {
  auto& command =
      *app.add_subcommand("new", "Writes a new crate file, or the JSON schema of crate files");
  auto& kind =
      *command.add_subcommand("crate", "Writes NAME.toml with comments; it runs on device models");
  auto& schema =
      *command.add_subcommand("schema", "Prints a JSON schema of crate files, for editors");
  schema.callback([&run] {
    run = [] {
      fmt::print("{}\n", crateSchema().dump(2));
      return 0;
    };
  });
  command.require_subcommand(1);
  auto name = std::make_shared<std::string>();
  kind.add_option("name", *name, "Name of the crate")->required();
  kind.callback([name, &run] { run = [name] { return writeNewCrate(*name); }; });
}

}  // namespace mpf::crate
