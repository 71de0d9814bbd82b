// SPDX-License-Identifier: MIT
// mpf gpib-sniff: shows every byte on the bus of a GPIB server, live (manual, "gpibSniff"), without
// disturbing the bus.
#include <CLI/CLI.hpp>
#include <memory>

#include "base/command_line.h"
#include "tools/arguments.h"
#include "tools/commands.h"
#include "tools/tap/gpib_sniff_format.h"
#include "tools/tap/sniffer.h"

namespace mpf::tools {
namespace {

struct GpibSniffArguments : ServerArguments {
  Nanoseconds duration{0};
  bool decode = false;
  bool json = false;

  [[nodiscard]] std::string format() const {
    if (json) return "json";
    return decode ? "decode" : "manual";
  }
};

}  // namespace

void addGpibSniff(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand(
      "gpib-sniff", "Shows every byte that a GPIB server sends (T) and receives (R), live");
  auto arguments = std::make_shared<GpibSniffArguments>();
  addServer(command, *arguments);
  addTime(command, "seconds", arguments->duration, "Duration; 0: until Ctrl-C");
  auto* const decode = command.add_flag(
      "--decode", arguments->decode,
      "Names of commands (UNL, LAG 22, TAG 5), data and EOI, with times; otherwise as the "
      "original MPF printed them: _ is UNT, ? is UNL");
  addJson(command, arguments->json);
  command.get_option("--json")->excludes(decode);
  command.callback([arguments, &run] {
    run = [arguments] {
      auto format = GpibSniffFormat::make(arguments->format(), realtimeOffsetNs());
      return sniff({.command = "gpib-sniff",
                    .kind = "a GPIB server",
                    .backplane = arguments->backplane,
                    .location = chosenLocation(arguments->location),
                    .server = arguments->server,
                    .duration = arguments->duration},
                   std::make_unique<SniffTextOf<GpibSniffFormat>>(std::move(format)));
    };
  });
}

}  // namespace mpf::tools
