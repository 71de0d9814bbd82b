// SPDX-License-Identifier: MIT
// mpf-gpib-server: a server for the instruments of a GPIB bus. The startup commands
// of the original MPF were
// initGpibServer("serverName","moduleName",bufferSize,queueSize), and before it
// initGpibGsTi9914("moduleName","carrierName","carrierSite",intVec).
#include <cstdio>
#include <fmt/format.h>

#include "base/run_main.h"
#include "base/stop_bell.h"
#include "server/programs/gpib_server/gpib_server.h"
#include "server/programs/gpib_server/open_bus.h"
#include "server/programs/gpib_server/sniff_source.h"
#include "server/programs/gpib_server/start_options.h"

namespace {

// A controller may show all bytes of a long transfer at once.
constexpr mpf::SniffBatching kSniffBatching{.maxBytes = 1 << 18};

int serve(int argc, char** argv) {
  mpf::GpibStartOptions options;
  if (const auto exit = options.parse(argc, argv)) return *exit;
  if (options.arguments.checkOnly) {
    for (const auto& start : options.ti9914.modules) options.hardware.check(start.place);
    return 0;
  }
  const auto& arguments = options.arguments;
  const mpf::ServerLog log("mpf-gpib-server", arguments.logLevel);
  mpf::StopBell stop;  // before the controller, whose start may take seconds
  const auto bus = mpf::openBus(options, log, stop);
  if (!bus) return 0;
  const auto backplane = mpf::Backplane::attach(arguments.backplane);
  mpf::MessageServer server(backplane, options.server, arguments.messages);
  mpf::logShortages(server, *log);
  mpf::ProgramFailure failure;  // destroyed after the servers, whose threads use it
  mpf::GpibServer served(server, *bus, options.limits, log);
  mpf::SniffServer sniff(backplane, options.server, arguments.messages, mpf::sniffSourceOf(*bus),
                         log, kSniffBatching);
  log->info(R"(serving {} as "{}" at location {}; listeners: "{}")", bus->description(),
            server.getName(), server.location(), sniff.getName());
  served.start([&] { failure.report(); });
  sniff.start([&] { failure.report(); });
  stop.wait();
  served.stop();
  log->info("stopped");
  return failure.exitStatus();
}

}  // namespace

int main(int argc, char** argv) {
  return mpf::runMain("mpf-gpib-server", [&] { return serve(argc, argv); });
}
