// SPDX-License-Identifier: MIT
// mpf-ip330-server: all servers of one Acromag IP330. --help shows the startup commands of the
// original MPF.
#include <cstdio>
#include <fmt/format.h>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>

#include "base/run_main.h"
#include "base/stop_bell.h"
#include "drivers/dac128v/dac128v_model.h"
#include "drivers/ip330/ip330_model.h"
#include "server/programs/hardware/wire_options.h"
#include "server/programs/ip330_server/ip330_servers.h"
#include "server/programs/ip330_server/start_options.h"

namespace {

constexpr const char* kProgram = "mpf-ip330-server";

// Creates a model with the typical errors of a real converter, which calibration corrects.
std::unique_ptr<mpf::Ip330Model> makeAdc(const mpf::Ip330StartOptions& options,
                                         mpf::ModelWires* wires) {
  auto model = std::make_unique<mpf::Ip330Model>(
      mpf::Ip330ModelOptions{.range = options.settings.range,
                             .gainError = {0.002, -0.003, 0.0015, -0.001},
                             .offsetError = {12, -9, 15, 20},
                             .noise = 0.5});
  if (options.signals.empty()) return model;
  std::map<std::string, mpf::Ip330SignalKind> kinds;
  kinds["wire"] = [wires](const std::string& name) -> mpf::Ip330Signal {
    if (wires == nullptr) throw std::invalid_argument("a wire needs --wires FILE");
    return [wire = wires->wire(name)](double) { return wire.get(); };
  };
  for (auto& [channel, signal] : mpf::parseIp330Signals(options.signals, kinds)) {
    if (const auto problem = options.settings.problemOfChannels(channel, channel); !problem.empty())
      throw std::invalid_argument("--signal: " + problem);
    model->setSignal(channel, signal);
  }
  return model;
}

std::unique_ptr<mpf::Dac128vModel> makeDac(const std::string& module, mpf::ModelWires* wires) {
  return std::make_unique<mpf::Dac128vModel>(
      mpf::Dac128vRanges{}, mpf::wireOutputs(wires, module, mpf::Dac128v::kChannels));
}

void addServers(mpf::Ip330Servers& servers, const mpf::Ip330StartOptions& options) {
  for (const auto& scan : options.scans)
    servers.addScan(scan.name, scan.queueSize, scan.first, scan.last,
                    std::chrono::milliseconds(scan.averageMs));
  for (const auto& config : options.configs) servers.addConfig(config.name, config.queueSize);
  for (const auto& sweep : options.sweeps)
    servers.addSweep(sweep.name, sweep.queueSize, sweep.first, sweep.last, sweep.maxPoints);
}

// Returns false when it was stopped while it waited for a module.
bool openDacs(mpf::Hardware& hardware, const mpf::Ip330StartOptions& options,
              const mpf::ServerLog& log, mpf::StopBell& stop,
              std::map<std::string, mpf::Dac128v>& dacs) {
  for (const auto& dac : options.dacs) {
    auto* const module = hardware.open(
        dac, mpf::Dac128v::kind(), [&] { return makeDac(dac.name, hardware.wires()); }, log, stop);
    if (module == nullptr) return false;
    dacs.try_emplace(dac.name, *module);
  }
  return true;
}

void describe(const mpf::Ip330Servers& servers, mpf::Ip330& board,
              const mpf::IndustryPackModule& module, const mpf::ServerLog& log) {
  const auto settings = board.settings();
  log->info("serving the {} at {} (channels {} to {}, {} V, {}, {} us per scan) as {}",
            module.kind().name, module.where(), settings.firstChannel, settings.lastChannel,
            toString(settings.range), toString(settings.scanMode), board.microsecondsPerScan(),
            servers.names());
}

void check(const mpf::Ip330StartOptions& options, const mpf::Hardware& hardware) {
  hardware.check(options.place);
  for (const auto& dac : options.dacs) hardware.check(dac);
  const auto makeNone = [](const std::string&) -> mpf::Ip330Signal { return {}; };
  if (!options.signals.empty())
    static_cast<void>(mpf::parseIp330Signals(options.signals, {{"wire", makeNone}}));
}

int serve(int argc, char** argv) {
  mpf::Ip330StartOptions options;
  mpf::Hardware hardware;
  if (const auto exit = options.parse(argc, argv, hardware)) return *exit;
  if (options.arguments.checkOnly) {
    check(options, hardware);
    return 0;
  }
  const mpf::ServerLog log(kProgram, options.arguments.logLevel);
  auto* const module = hardware.open(
      options.place, mpf::kIp330, [&] { return makeAdc(options, hardware.wires()); }, log);
  if (module == nullptr) return 0;
  hardware.logPriority(log);
  if (options.settings.vector != 0) hardware.modules().takeVector(options.settings.vector, *module);
  std::map<std::string, mpf::Dac128v> dacs;
  mpf::ProgramFailure failure;
  mpf::StopBell stop;
  const auto backplane = mpf::Backplane::attach(options.arguments.backplane);
  mpf::Ip330Servers servers(backplane, options.arguments.messages, *module, options.settings, log,
                            {}, [&] { failure.report(); });
  addServers(servers, options);
  if (!servers.names().empty()) describe(servers, servers.board(), *module, log);
  if (openDacs(hardware, options, log, stop, dacs)) {  // the other servers already serve
    for (const auto& pid : options.pids)
      servers.addPid(pid.name, pid.queueSize, pid.channel, dacs.at(pid.dac), pid.dacChannel);
    if (!options.pids.empty()) describe(servers, servers.board(), *module, log);
    stop.wait();
  }
  log->info("stopped");
  return failure.exitStatus();
}

}  // namespace

int main(int argc, char** argv) {
  return mpf::runMain(kProgram, [&] { return serve(argc, argv); });
}
