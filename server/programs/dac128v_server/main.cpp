// SPDX-License-Identifier: MIT
// mpf-dac128v-server: a server for one DAC128V. The startup command of the original MPF
// was initDAC128V("module","carrier","site",queueSize).
#include <CLI/CLI.hpp>
#include <cstdio>
#include <fmt/format.h>
#include <memory>
#include <optional>

#include "base/command_line.h"
#include "base/run_main.h"
#include "drivers/dac128v/dac128v_model.h"
#include "server/programs/dac128v_server/dac128v_server.h"
#include "server/programs/hardware/hardware.h"
#include "server/programs/hardware/wire_options.h"
#include "server/programs/server_arguments.h"

namespace {

constexpr const char* kProgram = "mpf-dac128v-server";

struct Options {
  mpf::ModulePlace place;
  mpf::Dac128vRanges ranges;
  mpf::ServerArguments arguments;

  std::optional<int> parse(int argc, char** argv, mpf::Hardware& hardware) {
    CLI::App app(
        "mpf-dac128v-server - serves the eight outputs of a Systran DAC128V to the clients of a "
        "backplane",
        kProgram);
    place.addTo(app, "Name of the module and of its server");
    arguments.addQueueSizeTo(app);
    app.add_option_function<std::string>(
           "--ranges", [this](const std::string& text) { takeRanges(text); },
           "Output ranges of a model, as its jumpers select them: LOWtoHIGH for all channels, or "
           "two ranges for channels 0 to 3 and 4 to 7")
        ->default_str("-10to10,-10to10");
    hardware.addTo(app);
    arguments.addTo(app);
    app.footer(
        "Startup command of the original MPF: initDAC128V(\"module\", \"carrier\", \"site\", "
        "queuesize)\n"
        "The outputs of a model drive the wires MODULE.0 to MODULE.7, in volts.\n"
        "Example: mpf-dac128v-server dac ipac IP_a 20 --carrier ipac=model");
    return mpf::parseCommandLine(app, argc, argv);
  }

 private:
  void takeRanges(const std::string& text) try {
    ranges = mpf::parseDac128vRanges(text);
  } catch (const std::invalid_argument& error) {
    throw CLI::ValidationError("--ranges", error.what());
  }
};

int serve(int argc, char** argv) {
  Options options;
  mpf::Hardware hardware;
  if (const auto exit = mpf::parseOrCheck(options, hardware, argc, argv)) return *exit;
  const auto& arguments = options.arguments;
  const mpf::ServerLog log(kProgram, arguments.logLevel);
  auto* const module = hardware.open(
      options.place, mpf::Dac128v::kind(),
      [&] {
        return std::make_unique<mpf::Dac128vModel>(
            options.ranges,
            mpf::wireOutputs(hardware.wires(), options.place.name, mpf::Dac128v::kChannels));
      },
      log);
  if (module == nullptr) return 0;
  mpf::Dac128v dac(*module);
  mpf::MessageServer server(mpf::Backplane::attach(arguments.backplane), options.place.name,
                            arguments.messages);
  const mpf::Dac128vServer outputs(server, dac, log);
  return mpf::runServer(server, *module, log);
}

}  // namespace

int main(int argc, char** argv) {
  return mpf::runMain(kProgram, [&] { return serve(argc, argv); });
}
