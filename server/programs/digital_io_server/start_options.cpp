// SPDX-License-Identifier: MIT
#include "server/programs/digital_io_server/start_options.h"

#include <CLI/CLI.hpp>
#include <chrono>

#include "base/command_line.h"

namespace mpf {
namespace {

constexpr std::chrono::milliseconds kDefaultPoll{100};
constexpr int kHighestBit = 31;

const DigitalIoKind* kindNamed(const std::string& name) {
  if (const auto* const kind = findDigitalIoKind(name)) return kind;
  std::string names;
  for (const auto& kind : digitalIoKinds())
    names += (names.empty() ? "" : ", ") + std::string(kind.name);
  throw CLI::ValidationError("--kind", "unknown kind \"" + name + "\"; the kinds are " + names);
}

}  // namespace

std::optional<int> DigitalIoStartOptions::parse(int argc, char** argv, Hardware& hardware) {
  CLI::App app(
      "mpf-digital-io-server - serves the lines of an IP-Unidig or DIO316I module to the clients "
      "of a backplane",
      "mpf-digital-io-server");
  std::uint64_t pollMs = kDefaultPoll.count();
  std::uint32_t both = 0;
  std::string kindName = "IP-Unidig-I";
  place.addTo(app, "Name of the module; clients find its servers as <module>In and <module>Out");
  arguments.addQueueSizeTo(app);
  app.add_option("mspoll", pollMs, "Longest time between two readings of the inputs [ms]; 0: 100")
      ->capture_default_str()
      ->check(wholeNumber(0, 3'600'000));
  app.add_option("intvec", io.vector, "Interrupt vector, 1 to 255; 0: no interrupts")
      ->capture_default_str()
      ->check(wholeNumber(0, 255));
  app.add_option("risingmask", io.rising, "Inputs that interrupt on a rising edge, as 0xff")
      ->capture_default_str();
  app.add_option("fallingmask", io.falling, "Inputs that interrupt on a falling edge")
      ->capture_default_str();
  app.add_option("bimask", both, "Inputs that interrupt on both edges")->capture_default_str();
  app.add_option("maxclients", maxClients,
                 "Ignored, kept for old command lines: any number of clients may monitor");
  app.add_option("--kind", kindName, "Kind of a model; a real module identifies itself")
      ->capture_default_str();
  hardware.addTo(app);
  inputs.addTo(app, kHighestBit);
  arguments.addTo(app);
  app.footer(
      "Startup command of the original MPF: initIpUnidig(\"module\", \"carrier\", \"site\", "
      "queuesize, mspoll, intvec, "
      "risingmask, fallingmask, bimask, "
      "maxclients)\n"
      "The outputs of a model drive the wires MODULE.0, MODULE.1, ..., with 0 or 5 volts.\n"
      "Example: mpf-digital-io-server dio ipac IP_b 20 100 116 0xff 0xff --carrier ipac=model");
  app.callback([&] { kind = kindNamed(kindName); });
  if (const auto status = parseCommandLine(app, argc, argv)) return status;
  io.pollEvery = pollMs == 0 ? kDefaultPoll : std::chrono::milliseconds(pollMs);
  io.rising |= both;
  io.falling |= both;
  return std::nullopt;
}

}  // namespace mpf
