// SPDX-License-Identifier: MIT
// mpf sniff: shows every byte that a serial server sends and receives, live (manual,
// "serialPortSniff"), without disturbing the line.
#include <CLI/CLI.hpp>
#include <memory>

#include "base/command_line.h"
#include "tools/arguments.h"
#include "tools/commands.h"
#include "tools/tap/sniff_format.h"
#include "tools/tap/sniffer.h"

namespace mpf::tools {
namespace {

struct SniffArguments : ServerArguments {
  Nanoseconds duration{0};
  std::string format = "lines";
  bool json = false;
};

}  // namespace

void addSniff(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand(
      "sniff", "Shows every byte that a serial server sends (T) and receives (R), live");
  auto arguments = std::make_shared<SniffArguments>();
  addServer(command, *arguments);
  addTime(command, "seconds", arguments->duration, "Duration; 0: until Ctrl-C");
  command
      .add_option("--format", arguments->format,
                  "lines: one direction in a line, with times; manual: ten bytes in a line, as the "
                  "original MPF printed them")
      ->capture_default_str()
      ->check(CLI::IsMember({"lines", "manual"}));
  addJson(command, arguments->json);
  command.callback([arguments, &run] {
    run = [arguments] {
      auto format =
          SniffFormat::make(arguments->json ? "json" : arguments->format, realtimeOffsetNs());
      return sniff({.command = "sniff",
                    .kind = "a serial server",
                    .backplane = arguments->backplane,
                    .location = chosenLocation(arguments->location),
                    .server = arguments->server,
                    .duration = arguments->duration},
                   std::make_unique<SniffTextOf<SniffFormat>>(std::move(format)));
    };
  });
}

}  // namespace mpf::tools
