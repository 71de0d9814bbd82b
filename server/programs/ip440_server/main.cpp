// SPDX-License-Identifier: MIT
// mpf-ip440-server: a server for one IP440.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <fmt/format.h>
#include <memory>
#include <optional>

#include "base/command_line.h"
#include "base/run_main.h"
#include "drivers/ip440/ip440_model.h"
#include "server/programs/hardware/hardware.h"
#include "server/programs/hardware/wire_options.h"
#include "server/programs/ip440_server/ip440_server.h"
#include "server/programs/server_arguments.h"

namespace {

constexpr const char* kProgram = "mpf-ip440-server";

struct Options {
  mpf::ModulePlace place;
  std::uint32_t inputs = 0;
  mpf::InputWires wired;
  mpf::ServerArguments arguments;

  std::optional<int> parse(int argc, char** argv, mpf::Hardware& hardware) {
    CLI::App app(
        "mpf-ip440-server - serves the 32 inputs of an Acromag IP440 to the clients of a backplane",
        kProgram);
    place.addTo(app, "Name of the module and of its server");
    arguments.addQueueSizeTo(app);
    app.add_option("--inputs", inputs,
                   "Inputs of a model that are on, as 0x80000001: bit 0 is IN00");
    hardware.addTo(app);
    wired.addTo(app, mpf::Ip440::kInputs - 1);
    arguments.addTo(app);
    app.footer(
        "The original MPF has no such server; the arguments follow its style.\n"
        "Example: mpf-ip440-server door ipac IP_c 20 --carrier ipac=model --inputs 0x5");
    return mpf::parseCommandLine(app, argc, argv);
  }
};

std::unique_ptr<mpf::Ip440Model> makeModel(const Options& options, mpf::ModelWires* wires) {
  auto model = std::make_unique<mpf::Ip440Model>(options.inputs);
  options.wired.connect(*model, wires);
  return model;
}

int serve(int argc, char** argv) {
  Options options;
  mpf::Hardware hardware;
  if (const auto exit = mpf::parseOrCheck(options, hardware, argc, argv)) return *exit;
  const mpf::ServerLog log(kProgram, options.arguments.logLevel);
  auto* const module = hardware.open(
      options.place, mpf::Ip440::kind(), [&] { return makeModel(options, hardware.wires()); }, log);
  if (module == nullptr) return 0;
  mpf::Ip440 inputs(*module);
  mpf::MessageServer server(mpf::Backplane::attach(options.arguments.backplane), options.place.name,
                            options.arguments.messages);
  const mpf::Ip440Server served(server, inputs, log);
  return mpf::runServer(server, *module, log);
}

}  // namespace

int main(int argc, char** argv) {
  return mpf::runMain(kProgram, [&] { return serve(argc, argv); });
}
