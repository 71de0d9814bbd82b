// SPDX-License-Identifier: MIT
// mpf-bench: the program that `mpf bench` executes. `mpf bench python` executes the module
// mpf.bench of the Python package.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <fmt/format.h>
#include <string>
#include <system_error>
#include <vector>

#include "base/command_line.h"
#include "base/run_main.h"
#include "benchmarks/epics/epics.h"
#include "benchmarks/hardware/hardware.h"
#include "benchmarks/local/local.h"
#include "benchmarks/remote/remote.h"

namespace {

constexpr const char* kPythonHelp =
    "Measures calls from Python beside other packages, with the package mpf of python3; its "
    "options "
    "are those of `python3 -m mpf.bench --help`";

// Replaces this process by Python.
int runPython(const std::vector<std::string>& arguments) {
  std::vector<std::string> words = {"python3", "-m", "mpf.bench"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (auto& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  ::execvp(pointers[0], pointers.data());
  throw std::system_error(errno, std::generic_category(), "cannot execute python3");
}

int bench(int argc, char** argv) {
  CLI::App app("mpf bench - measures messages beside the hardware limits and other message systems",
               "mpf bench");
  auto& local = *app.add_subcommand("local", mpf::bench::kLocalHelp);
  auto& remote = *app.add_subcommand("remote", mpf::bench::kRemoteHelp);
  auto& hardware = *app.add_subcommand("hardware", mpf::bench::kHardwareHelp);
  auto& epics = *app.add_subcommand("epics", mpf::bench::kEpicsHelp);
  auto& python = *app.add_subcommand("python", kPythonHelp);
  python.prefix_command();
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
  if (python.parsed()) return runPython(python.remaining());
  if (epics.parsed()) return mpf::bench::runEpics(epicsOptions);
  if (hardware.parsed()) return mpf::bench::runHardware(hardwareOptions);
  return local.parsed() ? mpf::bench::runLocal(localOptions) : mpf::bench::runRemote(remoteOptions);
}

}  // namespace

int main(int argc, char** argv) {
  return mpf::runMain("mpf bench", [&] { return bench(argc, argv); });
}
