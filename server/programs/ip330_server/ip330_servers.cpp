// SPDX-License-Identifier: MIT
#include "server/programs/ip330_server/ip330_servers.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <stdexcept>
#include <utility>

#include "server/programs/ip330_server/dac128v_output.h"
#include "server/programs/ip330_server/scan_server.h"
#include "server/programs/ip330_server/sweep_server.h"

namespace mpf {
namespace {

// A feedback loop with its output, which is destroyed after it.
struct DrivenPid {
  DrivenPid(Ip330& board, int channel, Dac128v& dac, int dacChannel, Ip330Faults::Hook hook)
      : output(dac, dacChannel),
        pid(board, channel, output, 0, Dac128v::kMaxCode, std::move(hook)) {}
  Dac128vOutput output;
  Ip330Pid pid;
};

}  // namespace

Ip330Servers::Ip330Servers(const Backplane& backplane, const ServerOptions& options,
                           IndustryPackModule& module, const Ip330Settings& settings,
                           const ServerLog& log, const Ip330Limits& limits,
                           std::function<void()> failed)
    : backplane_(backplane), options_(options), log_(log), failed_(std::move(failed)) {
  board_ = std::make_unique<Ip330>(
      module, settings, [this](const std::string& text, bool isThere) { note(text, isThere); },
      limits);
}

Ip330Servers::~Ip330Servers() {
  for (const auto& unit : units_) {
    if (unit->stop) unit->stop();
    unit->server->interrupt();
    unit->thread.join();
  }
  for (const auto& unit : units_) {  // a feedback loop may call note() until it is destroyed
    unit->logic.reset();
    unit->device.reset();
  }
  board_.reset();
}

void Ip330Servers::note(const std::string& text, bool isThere) {
  if (!isThere) return log_->info("{}", text);
  log_->warn("{}", text);
  const std::lock_guard lock(mutex_);
  for (auto* const server : alarmed_) server->countAlarm();
}

Ip330Servers::Unit& Ip330Servers::addUnit(const std::string& name, int queueSize) {
  auto options = options_;
  options.queueSize = queueSize;
  auto unit = std::make_unique<Unit>();
  unit->server = std::make_unique<MessageServer>(backplane_, name, options);
  logShortages(*unit->server, *log_);
  units_.push_back(std::move(unit));
  const std::lock_guard lock(mutex_);
  alarmed_.push_back(units_.back()->server.get());
  // Counts a problem that the board reported before this server existed.
  if (!board_->problem().empty()) units_.back()->server->countAlarm();
  return *units_.back();
}

void Ip330Servers::serve(Unit& unit) {
  unit.thread.start(log_, [&server = *unit.server] { server.run(); }, failed_);
}

void Ip330Servers::addScan(const std::string& name, int queueSize, int first, int last,
                           std::chrono::milliseconds average) {
  const auto scan = std::make_shared<Ip330Scan>(*board_, first, last);
  auto& unit = addUnit(name, queueSize);
  unit.device = scan;
  unit.stop = [&waiting = *scan] { waiting.stop(); };
  unit.logic = std::make_shared<Ip330ScanServer>(*unit.server, *scan, average, log_);
  serve(unit);
}

void Ip330Servers::addConfig(const std::string& name, int queueSize) {
  auto& unit = addUnit(name, queueSize);
  unit.logic = std::make_shared<Ip330ConfigServer>(*unit.server, *board_, log_);
  serve(unit);
}

void Ip330Servers::addSweep(const std::string& name, int queueSize, int first, int last,
                            int maxPoints) {
  const auto sweep = std::make_shared<Ip330Sweep>(*board_, first, last, maxPoints);
  auto& unit = addUnit(name, queueSize);
  unit.device = sweep;
  unit.logic = std::make_shared<Ip330SweepServer>(*unit.server, *board_, *sweep, log_);
  serve(unit);
}

void Ip330Servers::addPid(const std::string& name, int queueSize, int channel, Dac128v& dac,
                          int dacChannel) {
  if (dacChannel < 0 || dacChannel >= Dac128v::kChannels)
    throw std::invalid_argument(
        fmt::format("DAC channel {}: use 0 to {}", dacChannel, Dac128v::kChannels - 1));
  const auto driven = std::make_shared<DrivenPid>(
      *board_, channel, dac, dacChannel, [this, name](const std::string& text, bool isThere) {
        note(fmt::format("{}: {}", name, text), isThere);
      });
  auto& unit = addUnit(name, queueSize);
  unit.device = driven;
  unit.logic = std::make_shared<Ip330PidServer>(*unit.server, driven->pid, log_);
  serve(unit);
}

std::string Ip330Servers::names() const {
  std::vector<std::string> names;
  names.reserve(units_.size());
  for (const auto& unit : units_) names.push_back("\"" + unit->server->getName() + "\"");
  return fmt::format("{}", fmt::join(names, ", "));
}

}  // namespace mpf
