// SPDX-License-Identifier: MIT
// mpf-bench: the program that `mpf bench` executes.
#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "base/command_line.h"
#include "base/run_main.h"
#include "benchmarks/epics/epics.h"
#include "benchmarks/hardware/hardware.h"
#include "benchmarks/local/local.h"
#include "benchmarks/remote/remote.h"

namespace {

int bench(int argc, char** argv) {
  CLI::App app("mpf bench - measures messages beside the physical floors and other message systems",
               "mpf bench");
  auto& local = *app.add_subcommand("local", mpf::bench::kLocalHelp);
  auto& remote = *app.add_subcommand("remote", mpf::bench::kRemoteHelp);
  auto& hardware = *app.add_subcommand("hardware", mpf::bench::kHardwareHelp);
  auto& epics = *app.add_subcommand("epics", mpf::bench::kEpicsHelp);
  mpf::bench::Options localOptions;
  mpf::bench::RemoteOptions remoteOptions;
  mpf::bench::HardwareOptions hardwareOptions;
  mpf::bench::EpicsOptions epicsOptions;
  mpf::bench::addOptions(local, localOptions);
  mpf::bench::addOptions(remote, remoteOptions);
  mpf::bench::addOptions(hardware, hardwareOptions);
  mpf::bench::addOptions(epics, epicsOptions);
  app.require_subcommand(1);
  if (const auto status = mpf::parseCommandLine(app, argc, argv)) return *status;
  std::string commandLine = "mpf bench";
  for (int i = 1; i < argc; ++i) commandLine += std::string(" ") + argv[i];
  localOptions.commandLine = remoteOptions.commandLine = hardwareOptions.commandLine =
      epicsOptions.commandLine = commandLine;
  if (epics.parsed()) return mpf::bench::runEpics(epicsOptions);
  if (hardware.parsed()) return mpf::bench::runHardware(hardwareOptions);
  return local.parsed() ? mpf::bench::runLocal(localOptions) : mpf::bench::runRemote(remoteOptions);
}

}  // namespace

int main(int argc, char** argv) {
  return mpf::runMain("mpf bench", [&] { return bench(argc, argv); });
}
