// SPDX-License-Identifier: MIT
#include "crate/commands/crate_source.h"

#include <CLI/CLI.hpp>
#include <filesystem>
#include <fmt/format.h>

#include "base/output_file.h"
#include "base/print_error.h"
#include "crate/config/check_start.h"
#include "crate/config/read_crate.h"
#include "crate/supervisor/crate_folder.h"

namespace mpf::crate {
namespace {

constexpr const char* kIocFile = "ioc.cmd";

std::string checkedName(const std::string& name) {
  const auto problem = problemOfName(name);
  if (!problem.empty()) throw ConfigError("--" + problem);
  return name;
}

}  // namespace

void CrateSource::addOptions(CLI::App& command) {
  command
      .add_option("file", file_,
                  "Crate file (NAME.toml; see `mpf new`), or startup file of the original MPF")
      ->required();
  command
      .add_option("--carrier", carriers_,
                  "KIND replaces the boards of all carriers (model: device models), NAME=KIND "
                  "those of one; may be repeated")
      ->allow_extra_args(false)
      ->type_name("[NAME=]KIND");
  command.add_option("--address", address_,
                     "Address for all routers of a startup file, such as 127.0.0.1");
  command
      .add_option("--define", symbols_,
                  "Defines a symbol of a startup file, as cdCommands of a site does, such as "
                  "ip=/site/ip; may be repeated")
      ->allow_extra_args(false)
      ->type_name("NAME=TEXT");
  command.add_option("--name", name_,
                     "Name of the crate; default: the name of a crate file, or the folder of a "
                     "startup file");
}

std::map<std::string, std::string> CrateSource::carrierKinds() const {
  std::map<std::string, std::string> kinds;
  for (const auto& text : carriers_) {
    const auto equals = text.find('=');
    if (equals == std::string::npos) kinds[""] = text;
    else kinds[text.substr(0, equals)] = text.substr(equals + 1);
  }
  return kinds;
}

startup::Startup CrateSource::readStartup(const std::string& iocFile, bool usesModels) const {
  startup::StartupOptions options;
  options.crateName = name_;
  options.carriers = carrierKinds();
  if (usesModels) options.carriers.emplace("", "model");
  options.address = address_;
  options.iocFile = iocFile;
  for (const auto& text : symbols_) {
    const auto equals = text.find('=');
    if (equals == std::string::npos || equals == 0)
      throw ConfigError(fmt::format("--define {}: write NAME=TEXT", text));
    options.symbols[text.substr(0, equals)] = text.substr(equals + 1);
  }
  return startup::readStartup(file_, options);
}

Crate CrateSource::read() const {
  if (isStartupFile()) return readStartup(kIocFile, false).crate;
  ConfigErrors errors;
  auto crate = readFile(errors);
  errors.throwIfAny();
  return crate;
}

Crate CrateSource::check() const {
  if (isStartupFile()) return read();
  ConfigErrors errors;
  auto crate = readFile(errors);
  checkStart(crate, errors);
  errors.throwIfAny();
  return crate;
}

Crate CrateSource::readFile(ConfigErrors& errors) const {
  if (!address_.empty() || !symbols_.empty())
    throw ConfigError(
        fmt::format("{} is a crate file; --address and --define are for startup "
                    "files: change the crate file instead",
                    file_));
  auto crate = readCrate(file_, errors);
  if (!name_.empty()) crate.name = checkedName(name_);
  const auto kinds = carrierKinds();
  checkCarrierNames(crate, kinds, errors);
  for (auto& carrier : crate.carriers) {
    auto replaced = kinds.find(carrier.name);
    if (replaced == kinds.end()) replaced = kinds.find("");
    if (replaced != kinds.end()) carrier.kind = replaced->second;
  }
  return crate;
}

Crate CrateSource::prepare() const {
  if (!isStartupFile()) return check();
  const auto folder = CrateFolder::of(readStartup(kIocFile, false).crate.name);
  auto startup = readStartup(folder.file(kIocFile), false);
  if (!startup.iocText.empty()) {
    folder.create();
    replaceFile(folder.file(kIocFile), startup.iocText, 0600);
  }
  return startup.crate;
}

void printDiagnostics(const startup::Diagnostics& diagnostics, bool withNotes) {
  for (const auto& diagnostic : diagnostics.all())
    if (withNotes || diagnostic.severity != startup::Severity::note)
      printError("{}\n", diagnostic.formatted());
}

}  // namespace mpf::crate
