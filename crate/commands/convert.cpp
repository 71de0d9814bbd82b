// SPDX-License-Identifier: MIT
// mpf convert: writes the crate file that a startup file of the original MPF amounts to.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <fmt/format.h>
#include <memory>

#include "base/output_file.h"
#include "base/toml/config_errors.h"
#include "crate/commands/commands.h"
#include "crate/commands/crate_source.h"
#include "crate/config/write_crate.h"

namespace mpf::crate {
namespace {

struct ConvertArguments {
  CrateSource source;
  std::string folder = ".";
};

void checkIsAbsent(const std::filesystem::path& path) {
  if (std::filesystem::exists(path))
    throw std::runtime_error(
        fmt::format("{} exists; choose another --output or --name, or remove it", path.string()));
}

void writeFile(const std::filesystem::path& path, const std::string& text) {
  OutputFile output(path.string());
  output.write(text);
  output.close();
  fmt::print("{} is written\n", path.string());
}

int convert(const ConvertArguments& arguments) {
  const auto& source = arguments.source;
  if (!source.isStartupFile())
    throw std::invalid_argument(
        fmt::format("{} is a crate file; use a startup file of the original MPF", source.file()));
  // The name of the crate decides the names of the files.
  const auto name = source.readStartup("ioc.cmd", true).crate.name;
  const auto iocFile = name + "-ioc.cmd";
  const auto startup = source.readStartup(iocFile, true);
  printDiagnostics(startup.diagnostics, true);
  const std::filesystem::path folder(arguments.folder);
  const auto file = folder / (name + ".toml");
  if (!startup.iocText.empty()) checkIsAbsent(folder / iocFile);
  checkIsAbsent(file);
  if (!startup.iocText.empty()) writeFile(folder / iocFile, startup.iocText);
  writeFile(file, writeCrate(startup.crate,
                             fmt::format("Crate {0}, converted from {1} by `mpf convert`. Each "
                                         "comment is the line that an entry comes from.\n"
                                         "Start it with: mpf run {0}.toml",
                                         name, source.file())));
  return 0;
}

}  // namespace

void addConvert(CLI::App& app, Run& run) {
  auto& command =
      *app.add_subcommand("convert", "Converts a startup file of the original MPF to a crate file");
  auto arguments = std::make_shared<ConvertArguments>();
  arguments->source.addOptions(command);
  command.get_option("file")->description("Startup file of the original MPF");
  command.get_option("--name")->description(
      "Name of the crate; default: the folder of the startup file");
  command.add_option("--output", arguments->folder, "Folder for the files")
      ->capture_default_str()
      ->type_name("FOLDER");
  command.footer(
      "Carriers without --carrier become model carriers, because MPF cannot access VME and ISA "
      "boards.\nLines that are skipped are listed with the reason.");
  command.callback([arguments, &run] { run = [arguments] { return convert(*arguments); }; });
}

}  // namespace mpf::crate
