// SPDX-License-Identifier: MIT
// Commands of an EPICS IOC, which mpf-ioc executes.
#include <filesystem>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <numeric>
#include <system_error>
#include <vector>

#include "crate/startup/commands/command_table.h"

namespace mpf::startup {
namespace {

namespace fs = std::filesystem;

// Finds a file that a command names: in the current folder, or in the folder that another argument
// names, as vxWorks files do: dbLoadRecords("ipApp/Db/SR570.db", "P=x:", ip).
//   returns  "" after a warning, when it does not exist on this host
std::string findFile(CommandCall& call, const std::string& file, std::size_t folderAt) {
  std::vector<fs::path> folders{call.shell().folder()};
  if (const auto folder = call.value(folderAt).text()) folders.emplace_back(*folder);
  if (const auto top = call.shell().symbols().find("top"); top != call.shell().symbols().end())
    folders.emplace_back(top->second.text().value_or(""));
  std::vector<std::string> tried;
  for (const auto& folder : folders) {
    const auto path = (call.shell().folder() / folder / file).lexically_normal();
    std::error_code error;
    if (fs::is_regular_file(path, error)) return path.string();
    tried.push_back(path.string());
  }
  call.skip(Severity::warning, call.commandName() + " of " + file,
            fmt::format("there is no such file (looked for {})", fmt::join(tried, ", ")));
  return {};
}

// Adds a command of an IOC, unless iocsh cannot read one of its arguments.
//   positions  of the arguments in the command of the startup file
Value addToIoc(CommandCall& call, StartupSite& site, const std::string& command,
               const std::vector<std::string>& arguments,
               const std::vector<std::size_t>& positions) {
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (const auto problem = problemOfArgument(arguments[i]); !problem.empty())
      call.refuse(positions[i], fmt::format("the argument \"{}\" {}", arguments[i], problem));
  }
  if (!call.isValid()) return Value::unavailable();
  site.ioc.add(command, arguments, call.source());
  return Value();
}

Value loadRecords(CommandCall& call, StartupSite& site, std::size_t macrosAt,
                  std::size_t folderAt) {
  const auto file = call.text(0, "file");
  const auto macros = call.textOr(macrosAt, "macros", "");
  if (!call.isValid()) return Value::unavailable();
  const auto path = findFile(call, file, folderAt);
  if (path.empty()) return Value();
  return addToIoc(call, site, "dbLoadRecords", {path, macros}, {0, macrosAt});
}

// dbLoadRecords("file", "macros"[, folder])
Value dbLoadRecords(CommandCall& call, StartupSite& site) { return loadRecords(call, site, 1, 2); }

// dbLoadDatabase("file.dbd") describes record types, which mpf-ioc has; with another file it loads
// records: dbLoadDatabase("file.db", folder, "macros").
Value dbLoadDatabase(CommandCall& call, StartupSite& site) {
  const auto file = call.text(0, "file");
  if (!call.isValid()) return Value::unavailable();
  if (!file.ends_with(".dbd")) return loadRecords(call, site, 2, 1);
  call.skip(Severity::note, call.commandName() + " of " + file, "mpf-ioc has its own record types");
  return Value();
}

// dbLoadTemplate("file"[, folder])
Value dbLoadTemplate(CommandCall& call, StartupSite& site) {
  const auto file = call.text(0, "file");
  if (!call.isValid()) return Value::unavailable();
  const auto path = findFile(call, file, 1);
  if (path.empty()) return Value();
  return addToIoc(call, site, "dbLoadTemplate", {path}, {0});
}

Value passOn(CommandCall& call, StartupSite& site) {
  std::vector<std::string> arguments;
  std::vector<std::size_t> positions(call.size());
  std::iota(positions.begin(), positions.end(), std::size_t{0});
  for (std::size_t i = 0; i < call.size(); ++i) {
    const auto value = call.value(i);
    if (const auto text = value.text()) arguments.push_back(*text);
    else if (const auto number = value.real()) arguments.push_back(fmt::format("{}", *number));
    else call.text(i, "argument");
  }
  if (!call.isValid()) return Value::unavailable();
  return addToIoc(call, site, call.commandName(), arguments, positions);
}

constexpr CommandEntry kIocCommands[] = {
    {"dbLoadDatabase", dbLoadDatabase},
    {"dbLoadRecords", dbLoadRecords},
    {"dbLoadTemplate", dbLoadTemplate},
    {"iocInit", passOn},
    {"dbpf", passOn},
    {"dbgf", passOn},
    {"dbl", passOn},
    {"mrr", passOn},
    {"msr", passOn},
};

}  // namespace

std::span<const CommandEntry> iocCommands() { return kIocCommands; }

}  // namespace mpf::startup
