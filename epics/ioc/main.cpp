// SPDX-License-Identifier: MIT
// mpf-ioc: an EPICS IOC with the record types of Base and the device support of MPF.
#include <CLI/CLI.hpp>
#include <array>
#include <cstdlib>
#include <dbAccess.h>
#include <dlfcn.h>
#include <epicsExit.h>
#include <filesystem>
#include <fmt/format.h>
#include <iocInit.h>
#include <iocsh.h>
#include <iocshRegisterCommon.h>
#include <string>
#include <vector>

#include "base/command_line.h"
#include "base/run_main.h"
#include "base/service_manager.h"
#include "epics/ioc/service_stop.h"

namespace {

constexpr const char* kProgram = "mpf-ioc";

struct Options {
  std::string startup;
  std::vector<std::string> databases;
  std::string macros;
  bool noShell = false;
  bool checkOnly = false;
};

// The dbd files are installed beside the program, and lie in the same place in a build folder.
std::string dbdFolder() {
  return std::filesystem::canonical("/proc/self/exe").parent_path().parent_path() / "share/mpf/dbd";
}

void check(long status, const std::string& what) {
  if (status != 0) throw std::runtime_error(what);
}

void registerCommands() {
  iocshRegisterCommon();
  // dlload: exported by Base since 3.15.
  if (auto* registrar = static_cast<void (**)()>(::dlsym(RTLD_DEFAULT, "pvar_func_dlloadRegistar")))
    (*registrar)();
}

// Loads base.dbd and mpf.dbd, the breakpoint tables of thermocouples, and QSRV 2 (pvAccess) if this
// installation has it.
void loadDefinitions(const std::string& folder) {
  std::vector<std::string> names{"base.dbd", "mpf.dbd"};
  for (const char* name : {"bptTypeJdegC.dbd", "bptTypeJdegF.dbd", "bptTypeKdegC.dbd",
                           "bptTypeKdegF.dbd", "pvxsIoc.dbd"})
    if (std::filesystem::exists(fmt::format("{}/{}", folder, name))) names.emplace_back(name);
  for (const auto& name : names)
    check(dbLoadDatabase(name.c_str(), folder.c_str(), nullptr),
          fmt::format("cannot load {}/{}", folder, name));
  ::setenv("PVXS_QSRV_ENABLE", "YES", 0);
}

void load(const Options& options) {
  const auto folder = dbdFolder();
  loadDefinitions(folder);
  // All that the linked libraries export.
  check(registerAllRecordDeviceDrivers(pdbbase), "cannot register the record types");
  ::setenv("EPICS_DB_INCLUDE_PATH", fmt::format(".:{}", folder).c_str(), 0);
  for (const auto& file : options.databases)
    check(dbLoadRecords(file.c_str(), options.macros.c_str()),
          fmt::format("cannot load the database {}: see the error above", file));
}

int run(int argc, char** argv) {
  Options options;
  CLI::App app(
      "mpf-ioc - an EPICS IOC whose records talk to MPF servers\n\n"
      "Loads the databases, runs the startup file, and reads iocsh commands from standard input.\n"
      "Without a startup file it calls iocInit itself.",
      kProgram);
  app.add_option("startup", options.startup, "File with iocsh commands; it calls iocInit")
      ->check(CLI::ExistingFile);
  app.add_option("-d,--database", options.databases, "Database to load; may be repeated")
      ->type_name("FILE")
      ->allow_extra_args(false)
      ->check(CLI::ExistingFile);
  app.add_option("-m,--macros", options.macros, "Macros of the databases: \"P=lab:,N=1\"");
  app.add_flag("-S,--no-shell", options.noShell,
               "Do not read commands from standard input; run until SIGINT or SIGTERM");
  app.add_flag("--check", options.checkOnly,
               "Only check the arguments and load the databases; run no commands");
  if (const auto status = mpf::parseCommandLine(app, argc, argv)) return *status;
  static auto* const stop = options.noShell ? new mpf::ServiceStop : nullptr;  // never destroyed

  registerCommands();
  load(options);
  if (options.checkOnly) return 0;
  if (!options.startup.empty()) {
    check(iocsh(options.startup.c_str()),
          fmt::format("{}: a command failed: see the error above", options.startup));
  } else {
    check(iocInit(), "iocInit failed: see the error above");
  }
  mpf::ServiceManager::notifyReady();
  if (stop != nullptr) stop->wait();
  else iocsh(nullptr);
  epicsExit(0);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return mpf::runMain(kProgram, [&] { return run(argc, argv); });
}
