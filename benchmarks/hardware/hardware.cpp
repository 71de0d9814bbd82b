// SPDX-License-Identifier: MIT
#include "benchmarks/hardware/hardware.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <fmt/format.h>
#include <iterator>

#include "base/program_beside.h"
#include "benchmarks/peers/mpf_peer.h"

namespace mpf::bench {
namespace {

const std::vector<std::string> kEchoWords{"mpf-int32-server", "echo"};
constexpr const char* kWhyNotSpin =
    "spin would measure the scheduler: the echo server and the measured server share a CPU, and "
    "one "
    "would poll in the time of the other; use adaptive or block";

std::vector<Measurement> allRows(const Bench& bench) {
  auto all = roundTripRows(bench);
  for (auto more : {scanRows(bench), serialRows(bench)})
    std::move(more.begin(), more.end(), std::back_inserter(all));
  return all;
}

}  // namespace

HardwareServers::HardwareServers(Bench bench, std::vector<std::string> words)
    : bench_(std::move(bench)), words_(std::move(words)) {}

void HardwareServers::start() try {
  launch(echo_, kEchoWords);
  if (!words_.empty()) launch(measured_, words_);
} catch (...) {
  stop();
  throw;
}

void HardwareServers::stop() noexcept {
  const bool ran = echo_.pid() != 0 || measured_.pid() != 0;
  measured_.stop();
  echo_.stop();
  if (ran) removeBackplanes(bench_.backplane);
}

void HardwareServers::launch(Program& program, std::vector<std::string> words) {
  words.front() = programBeside(words.front());
  for (const auto* word : {"--location", "0", "--backplane", bench_.backplane.c_str(),
                           "--wait-mode", toString(bench_.wait)})
    words.emplace_back(word);
  program.start(std::move(words), bench_.placement.server, {});
}

std::string HardwareServers::missing() const {
  for (const auto* words : {&kEchoWords, &words_}) {
    if (words->empty()) continue;
    if (const auto program = programBeside(words->front()); !std::filesystem::exists(program))
      return program + " does not exist";
  }
  return {};
}

Outcome HardwareServers::run(const std::function<Outcome()>& row) {
  if (words_.empty()) return row();
  Outcome outcome;
  const auto ended = [&] {
    return measured_.hasEnded() ? words_.front() + " has ended: " + measured_.lastLine() : "";
  };
  outcome.error = ended();
  if (!outcome.error.empty()) return outcome;
  outcome = row();
  if (outcome.error.empty()) return outcome;
  const auto why = ended();
  outcome.error +=
      why.empty() ? "; last output of " + words_.front() + ": " + measured_.lastLine() : "; " + why;
  return outcome;
}

Measurement rowOf(const std::shared_ptr<HardwareServers>& servers, const std::string& environment,
                  const std::string& question, const std::string& name) {
  Measurement row;
  row.question = question;
  row.name = name;
  row.mode = servers->bench().wait;
  row.skipped = servers->missing();
  row.environment = [servers] { return std::make_unique<Running<HardwareServers>>(servers); };
  row.environmentName = environment;
  return row;
}

void addOptions(CLI::App& app, HardwareOptions& options) {
  addOptions(app, static_cast<Options&>(options));
  addWaitOption(app, options.wait)->description("How MPF servers and clients wait; not spin");
  app.callback([&options] {
    if (options.wait == Mode::spin) throw CLI::ValidationError("--wait", kWhyNotSpin);
  });
}

int runHardware(const HardwareOptions& options) {
  const auto placement = place(options, true);
  if (!placement) return 2;
  const Pace pace{std::chrono::milliseconds(800), std::chrono::seconds(12),
                  [&](const Measurement& row) { return options.quick || row.isSlow ? 1 : 3; }};
  return run(allRows({kRunPrefix + std::to_string(::getpid()), *placement, options.wait}),
             placement, options, pace, [&](const auto& results) {
               return fmt::format(
                          "CPU {}: servers and models. CPU {}: clients and instruments. All wait "
                          "in mode {}.\n",
                          toString(placement->server), toString(placement->requester),
                          toString(options.wait)) +
                      hardwareTable(results);
             });
}

}  // namespace mpf::bench
