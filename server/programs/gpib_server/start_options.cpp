// SPDX-License-Identifier: MIT
#include "server/programs/gpib_server/start_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fmt/format.h>

#include "base/command_line.h"

namespace mpf {
namespace {

constexpr int kLongestBuffer = 16 << 20;
constexpr TimeRange kLimit{.least = std::chrono::seconds(1), .most = std::chrono::hours(24)};

}  // namespace

std::optional<int> GpibStartOptions::parse(int argc, char** argv) {
  CLI::App app(
      "mpf-gpib-server - serves the instruments of a GPIB bus to the clients of a backplane",
      "mpf-gpib-server");
  app.add_option("server", server, "Name under which clients find it")->required();
  app.add_option("module", module,
                 "Controller of the bus: MODULE of --ti9914, prologix:HOST:PORT, "
                 "prologix:/dev/ttyUSB0, usbtmc:/dev/usbtmc0, or linux-gpib:0")
      ->required();
  app.add_option("bufsize", limits.bufferBytes, "Longest answer [bytes]")
      ->capture_default_str()
      ->check(wholeNumber(1, kLongestBuffer));
  arguments.addQueueSizeTo(app);
  addTime(app, "--timeout", limits.timeout, "Timeout of requests that have none", kLimit);
  addTime(app, "--max-timeout", limits.maxTimeout,
          "Longest time that one request may wait and use the bus", kLimit);
  addTime(app, "--max-lease", limits.maxLease, "Longest lease of the bus by one client", kLimit);
  addTime(app, "--poll-timeout", limits.pollTimeout,
          "Timeout of the serial poll of an instrument after a service request",
          {.least = std::chrono::milliseconds(1), .most = kLimit.most});
  ti9914.addTo(app);
  hardware.addTo(app);
  app.get_option("--wait")->description("Start even if the controller is missing, and wait for it");
  arguments.addTo(app);
  app.footer(
      "Startup commands of the original MPF:\n"
      "  initGpibGsTi9914(\"module\", \"carrier\", \"site\", intVec)\n"
      "  initGpibServer(\"server\", \"module\", bufsize, queuesize)\n"
      "Examples:\n"
      "  mpf-gpib-server GPIB0 prologix:gpib1:1234 4096 20\n"
      "  mpf-gpib-server GPIB0 a-ip488 1024 20 --carrier ipac=model "
      "--ti9914 a-ip488,ipac,IP_a,105");
  if (const auto status = parseCommandLine(app, argc, argv)) return status;
  const auto unused = std::ranges::find_if(
      ti9914.modules, [&](const Ti9914Start& start) { return start.place.name != module; });
  if (unused != ti9914.modules.end())
    return refuseArguments(app.get_name(),
                           fmt::format("--ti9914: {}: the server uses \"{}\"; start another "
                                       "server for another bus",
                                       unused->place.name, module));
  return std::nullopt;
}

}  // namespace mpf
