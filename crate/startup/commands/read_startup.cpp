// SPDX-License-Identifier: MIT
#include "crate/startup/commands/read_startup.h"

#include <algorithm>
#include <filesystem>
#include <fmt/format.h>
#include <iterator>
#include <set>

#include "base/toml/config_errors.h"
#include "crate/config/program_kinds.h"
#include "crate/config/read_crate.h"
#include "crate/startup/commands/command_table.h"
#include "crate/startup/commands/process_builder.h"
#include "drivers/industry_pack/carrier_parameters.h"

namespace mpf::startup {
namespace {

namespace fs = std::filesystem;

class SiteCommands final : public CommandHandler {
 public:
  explicit SiteCommands(StartupSite& site) : site_(site) {}
  std::optional<Value> tryExecute(const Command& command, StartupShell& shell) override {
    ++commands;
    const auto* const entry = findCommand(command.name);
    if (entry == nullptr) return std::nullopt;
    CommandCall call(command, shell);
    return entry->execute(call, site_);
  }
  int commands = 0;

 private:
  StartupSite& site_;
};

// Symbols that each site's cdCommands defines: the folder of the file is TOP/iocBoot/IOC.
void defineFolders(StartupShell& shell, const fs::path& folder) {
  const auto top = folder.parent_path().parent_path();
  shell.define("startup", Value::ofString(folder.string()));
  shell.define("top", Value::ofString(top.string()));
  for (const auto* const name : {"topbin", "appbin"})
    shell.define(name, Value::ofString((top / "bin").string()));
}

crate::Process iocProcess(const std::string& iocFile, const std::string& place,
                          const std::map<std::string, std::string>& environment) {
  auto process = newProcess("ioc", "ioc", place, "commands for the IOC");
  addValue(process, "startup", iocFile, place);
  process.environment = environment;
  process.notifies = true;
  return process;
}

// A server keeps the name of its module, port or server; a second process with the same name gets
// another one.
void makeNamesUnique(std::vector<crate::Process>& processes) {
  std::set<std::string> names;
  for (const auto& process : processes) names.insert(process.name);
  std::set<std::string> used;
  for (auto& process : processes) {
    if (used.insert(process.name).second) continue;
    const auto name = process.name;
    for (int use = 2; !names.insert(process.name).second; ++use)
      process.name = fmt::format("{}-{}", name, use);
  }
}

// Replaces the servers that processes need by the processes that serve them.
void needProcesses(std::vector<crate::Process>& processes) {
  std::map<std::string, std::string> processOf;
  for (const auto& process : processes)
    for (const auto& server : crate::serversOf(process)) processOf.emplace(server, process.name);
  for (auto& process : processes)
    for (auto& need : process.needs)
      if (const auto found = processOf.find(need); found != processOf.end()) need = found->second;
}

// The boards of old startup files sit on buses that no Linux host reaches.
void checkCarriers(const crate::Crate& crate, ConfigErrors& errors) {
  std::map<std::string, bool> isUsed;
  for (const auto& process : crate.processes)
    for (const auto& module : crate::modulesOf(process)) isUsed[module.carrier] = true;
  for (const auto& carrier : crate.carriers) {
    const auto kind = carrier.kind.substr(0, carrier.kind.find(':'));
    if (isUsed[carrier.name] && isParameterKind(kind))
      errors.add(carrier.place,
                 fmt::format("carrier \"{}\" is a {}, which this host cannot reach; use --carrier "
                             "model for models of its modules, or --carrier {}=tpci200 for a PCI "
                             "board that holds them",
                             carrier.name, kind, carrier.name));
  }
}

// A server router offers the servers of this host at another location.
void addLocalLocation(crate::Process& router, std::int32_t location) {
  if (const auto* const serve = router.find("serve"))
    setValue(router, "serve", fmt::format("{}={}", serve->values.front(), location), serve->place);
}

crate::Crate crateOf(StartupSite& site, const StartupOptions& options, const fs::path& file,
                     const std::map<std::string, std::string>& environment) {
  crate::Crate crate;
  crate.file = file.string();
  crate.name = options.crateName.empty() ? processName(file.parent_path().filename().string())
                                         : options.crateName;
  crate.location = site.location.value_or(0);
  crate.carriers = site.boards.carriers(options.carriers);
  crate.processes = site.serialLines.processes();
  for (auto& router : site.routers) addLocalLocation(router, crate.location);
  std::ranges::move(site.modules, std::back_inserter(crate.processes));
  std::ranges::move(site.routers, std::back_inserter(crate.processes));
  if (site.ioc.isNeeded())
    crate.processes.push_back(iocProcess(options.iocFile, file.string(), environment));
  std::ranges::move(site.sniffers, std::back_inserter(crate.processes));
  makeNamesUnique(crate.processes);
  needProcesses(crate.processes);
  return crate;
}

}  // namespace

Startup readStartup(const std::string& file, const StartupOptions& options) {
  const auto path = fs::absolute(file).lexically_normal();
  StartupSite site;
  site.address = options.address;
  SiteCommands commands(site);
  StartupShell shell(commands, path.parent_path());
  defineFolders(shell, path.parent_path());
  for (const auto& [name, value] : options.symbols) shell.define(name, Value::ofString(value));
  shell.execute(path.filename());

  ConfigErrors errors;
  for (const auto& diagnostic : shell.diagnostics().all())
    if (diagnostic.severity == Severity::error) errors.add("", diagnostic.formatted());
  errors.throwIfAny();
  Startup startup{crateOf(site, options, path, shell.environment()),
                  site.ioc.isNeeded() ? site.ioc.text() : "", shell.diagnostics(),
                  commands.commands};
  if (startup.crate.processes.empty())
    errors.add(path.string(), "no command of the file starts a server, a router or an IOC");
  else checkCrate(startup.crate, errors);
  checkCarrierNames(startup.crate, options.carriers, errors);
  checkCarriers(startup.crate, errors);
  errors.throwIfAny();
  return startup;
}

bool isStartupFile(const std::string& file) { return !file.ends_with(".toml"); }

}  // namespace mpf::startup
