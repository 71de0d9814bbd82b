// SPDX-License-Identifier: MIT
#include "server/programs/ip330_server/start_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fmt/format.h>
#include <limits>
#include <stdexcept>

#include "base/command_line.h"
#include "server/programs/hardware/option_fields.h"

namespace mpf {
namespace {

constexpr int kLeftOut = std::numeric_limits<int>::min();

int notNegative(const OptionFields& fields, const char* what, int value) {
  if (value < 0 && value != kLeftOut)
    fields.complain(fmt::format("{} {}: use 0 or more", what, value));
  return value;
}

constexpr const char* kFooter =
    "Without --scan, --config, --sweep and --pid it serves scans as MODULE and configuration as "
    "MODULEConfig.\n"
    "Startup commands of the original MPF, with their arguments in the same order as here:\n"
    "  initIp330(\"module\", \"carrier\", \"site\", \"type\", \"range\", first, last, maxclients, "
    "vector)\n"
    "  configIp330(ip330, scanMode, \"trigger\", usPerScan, secondsBetweenCalibrate)\n"
    "  initIp330Scan(ip330, \"server\", first, last, msToAverage, queuesize)\n"
    "  initIp330Scan(ip330, \"server\", first, last, queuesize) of release 1-7: write 0 for MS, "
    "between last and queuesize\n"
    "  initIp330Config(ip330, \"server\", queuesize)\n"
    "  initIp330Sweep(ip330, \"server\", first, last, maxPoints, queuesize)\n"
    "  initIp330PID(\"server\", ip330, channel, dac, dacChannel, queuesize)\n"
    "and of release 1-4 initIp330Scan(\"module\", \"carrier\", \"site\", \"type\", \"range\", "
    "vector, queuesize).\n"
    "DIP switches 1 to 10: -5to5 1011000010, -10to10 0100110010, 0to5 1010100100, 0to10 "
    "1011001000\n"
    "With range 0to5, gain 3 is calibrated with 0 V. If the converter has a negative offset, this "
    "is impossible, and requests with gain 3 get status -1.\n"
    "Example: mpf-ip330-server adc ipac IP_a D -5to5 0 15 10 120 --carrier ipac=model --signal "
    "0=sine:5:2";

}  // namespace

void Ip330StartOptions::addBoard(CLI::App& app) {
  place.addTo(app, "Name of the module");
  app.add_option("type", type_, "Inputs: D (differential) or S (single ended)")
      ->capture_default_str();
  app.add_option("range", range_, "Range of the DIP switches: -5to5, -10to10, 0to5 or 0to10")
      ->capture_default_str();
  app.add_option("first", settings.firstChannel, "First channel")->capture_default_str();
  app.add_option("last", settings.lastChannel, "Last channel")->capture_default_str();
  app.add_option("maxclients", settings.maxClients, "Highest number of scan, sweep and PID servers")
      ->capture_default_str();
  app.add_option("vector", settings.vector, "Interrupt vector")->capture_default_str();
  app.add_option("--scan-mode", scanMode_,
                 "0 disable, 1 uniformContinuous, 2 uniformSingle, 3 burstContinuous, 4 "
                 "burstSingle, 5 convertOnExternalTriggerOnly")
      ->capture_default_str();
  app.add_option("--trigger", trigger_, "Direction of the external trigger: Input or Output")
      ->capture_default_str();
  app.add_option("--us-per-scan", settings.microsecondsPerScan,
                 "Time from one scan of all channels to the next [us]")
      ->capture_default_str();
  app.add_option("--seconds-between-calibrate", settings.secondsBetweenCalibrate,
                 "Time between calibrations [s]; 0: once, at start; -1: never, values are raw")
      ->capture_default_str();
  app.add_option("--signal", signals,
                 "Signals at the inputs of a model: CHANNEL=dc:VOLTS, "
                 "CHANNEL=sine:HERTZ:VOLTS[:OFFSET], CHANNEL=wire:NAME, ...")
      ->type_name("TEXT");
}

void Ip330StartOptions::addServers(CLI::App& app) {
  addFields(
      app, "--scan", "NAME[,FIRST,LAST[,MS[,QUEUE]]]",
      "Adds a server of mean values; MS: averaging time of requests without one, 0: since the last "
      "request",
      [this](OptionFields& fields) {
        auto name = fields.word("name");
        const int first =
            notNegative(fields, "first channel", fields.number("first channel", kLeftOut));
        const int last = first == kLeftOut
                             ? fields.number("last channel", kLeftOut)
                             : notNegative(fields, "last channel", fields.number("last channel"));
        const int average =
            notNegative(fields, "averaging time", fields.number("averaging time", 0));
        scans.push_back({std::move(name), first, last, average, fields.queueSize()});
      });
  addFields(app, "--config", "NAME[,QUEUE]", "Adds a server for calibration and scan mode",
            [this](OptionFields& fields) {
              auto name = fields.word("name");
              configs.push_back({std::move(name), fields.queueSize()});
            });
  addFields(app, "--sweep", "NAME,FIRST,LAST,POINTS[,QUEUE]", "Adds a server of arrays over time",
            [this](OptionFields& fields) {
              auto name = fields.word("name");
              const int first = fields.number("first channel");
              const int last = fields.number("last channel");
              const int points = fields.number("points");
              sweeps.push_back({std::move(name), first, last, points, fields.queueSize()});
            });
  addFields(
      app, "--pid", "NAME,CHANNEL,DAC,DACCHANNEL[,QUEUE]",
      "Adds a server of fast feedback from a channel to a channel of a --dac",
      [this](OptionFields& fields) {
        auto name = fields.word("name");
        const int channel = fields.number("channel");
        auto dac = fields.word("name of the DAC");
        const int dacChannel = fields.number("DAC channel");
        pids.push_back({std::move(name), channel, std::move(dac), dacChannel, fields.queueSize()});
      });
  addFields(app, "--dac", "MODULE,CARRIER,SITE", "Opens a DAC128V for --pid",
            [this](OptionFields& fields) {
              auto name = fields.word("module");
              auto carrier = fields.word("carrier");
              dacs.push_back({std::move(name), std::move(carrier), fields.word("site")});
            });
}

void Ip330StartOptions::takeAll() {
  settings.type = parseIp330Type(type_);
  settings.range = parseIp330Range(range_);
  settings.scanMode = parseIp330ScanMode(scanMode_);
  settings.trigger = parseIp330Trigger(trigger_);
  if (const auto problem = settings.problem(); !problem.empty())
    throw std::invalid_argument(problem);
  for (const auto& pid : pids) {
    if (std::ranges::none_of(dacs, [&](const ModulePlace& dac) { return dac.name == pid.dac; }))
      throw std::invalid_argument(
          fmt::format("--pid {}: no --dac has the name {}", pid.name, pid.dac));
    if (!settings.has(pid.channel))
      throw std::invalid_argument(fmt::format("--pid {}: channel {}: the board scans {} to {}",
                                              pid.name, pid.channel, settings.firstChannel,
                                              settings.lastChannel));
  }
}

std::optional<int> Ip330StartOptions::parse(int argc, char** argv, Hardware& hardware) {
  CLI::App app(
      "mpf-ip330-server - serves the analog inputs of an Acromag IP330 to the clients of a "
      "backplane",
      "mpf-ip330-server");
  addBoard(app);
  addServers(app);
  hardware.addTo(app);
  arguments.addTo(app);
  app.footer(kFooter);
  if (const auto status = parseCommandLine(app, argc, argv)) return status;
  try {
    takeAll();
  } catch (const std::invalid_argument& error) {
    return refuseArguments(app.get_name(), error.what());
  }
  for (auto& scan : scans) {
    if (scan.first == kLeftOut) scan.first = settings.firstChannel;
    if (scan.last == kLeftOut) scan.last = settings.lastChannel;
  }
  if (scans.empty() && configs.empty() && sweeps.empty() && pids.empty()) {
    scans.push_back({place.name, settings.firstChannel, settings.lastChannel, 0,
                     OptionFields::kDefaultQueueSize});
    configs.push_back({place.name + "Config", OptionFields::kDefaultQueueSize});
  }
  return std::nullopt;
}

}  // namespace mpf
