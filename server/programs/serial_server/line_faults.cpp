// SPDX-License-Identifier: MIT
#include "server/programs/serial_server/line_faults.h"

#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <utility>
#include <vector>

#include <mpf/serial_commands.h>

#include "base/duration_text.h"

namespace mpf {
namespace {

// NOLINTNEXTLINE(google-build-using-namespace): the manual's words, all of them
using namespace serial;

constexpr std::uint64_t kMostAlarmsAtOnce = 100'000;  // a driver's counter may jump

std::string withCount(std::uint64_t count, const char* one, const char* many) {
  return fmt::format("{} {}", count, count == 1 ? one : many);
}

}  // namespace

std::uint8_t faultBit(LineFault fault) noexcept {
  switch (fault) {
    case LineFault::none:
      return 0;
    case LineFault::parity:
      return serialFaultParity;
    case LineFault::framing:
      return serialFaultFraming;
    case LineFault::breakSignal:
      return serialFaultBreak;
    case LineFault::overrun:
      return serialFaultOverrun;
    case LineFault::unplugged:
      return serialFaultUnplugged;
  }
  return 0;
}

LineFaults::LineFaults(MessageServer& server, const SerialPort& port, const ServerLog& log,
                       std::chrono::milliseconds quiet)
    : server_(server), port_(port), log_(log), quiet_(quiet), seen_(counted()) {}

LineFaults::~LineFaults() {
  look();
  const std::lock_guard lock(mutex_);
  if (untold_.sum() > 0) tell(Clock::nowNs());
}

LineFaults::Counts LineFaults::counted() const {
  const auto counters = port_.counters();
  return {counters.overruns, counters.parityErrors, counters.framingErrors, counters.breaks};
}

void LineFaults::look() {
  const std::lock_guard lock(mutex_);
  const auto now = counted();
  const auto before = std::exchange(seen_, now);
  const auto alarms = now.sum() - before.sum();
  const auto nowNs = Clock::nowNs();
  if (alarms > 0 && untold_.sum() == 0) untoldSinceNs_ = nowNs;
  untold_.overruns += now.overruns - before.overruns;
  untold_.parity += now.parity - before.parity;
  untold_.framing += now.framing - before.framing;
  untold_.breaks += now.breaks - before.breaks;
  for (std::uint64_t i = 0; i < std::min(alarms, kMostAlarmsAtOnce); ++i) server_.countAlarm();
  if (untold_.sum() > 0 && nowNs >= nextLineNs_) tell(nowNs);
}

void LineFaults::tell(std::int64_t nowNs) {
  const auto counts = std::exchange(untold_, {});
  const auto forNs = static_cast<double>(nowNs - untoldSinceNs_);
  const auto when = forNs > 0 ? fmt::format(" within {}", durationText(forNs)) : std::string();
  log_->warn("{}: the line lost or damaged bytes: {}", port_.description(), textOf(counts, when));
  nextLineNs_ = nowNs + quiet_.count();
}

std::string LineFaults::textOf(const Counts& counts, const std::string& when) {
  std::vector<std::string> kinds;
  if (counts.overruns > 0) kinds.push_back(withCount(counts.overruns, "overrun", "overruns"));
  if (counts.parity > 0) kinds.push_back(withCount(counts.parity, "parity error", "parity errors"));
  if (counts.framing > 0)
    kinds.push_back(withCount(counts.framing, "framing error", "framing errors"));
  if (counts.breaks > 0) kinds.push_back(withCount(counts.breaks, "break", "breaks"));
  auto text = fmt::format("{}{}", fmt::join(kinds, ", "), when);
  if (counts.overruns > 0) text += "; this program got no processor in time, see mpf doctor";
  if (counts.parity + counts.framing > 0)
    text += "; do both ends have the same settings, and is the cable good?";
  return text;
}

std::int32_t LineFaults::statusOf(std::int32_t status) const noexcept {
  if (answer_ == 0) return status;
  return answer_ == serialFaultOverrun ? serialServerStatusOverflow : serialServerStatusError;
}

void LineFaults::describe(Char8Array& reply) const noexcept {
  if (reply.status == serialServerStatusOverflow || reply.status == serialServerStatusError)
    reply.extra = answer_;
}

}  // namespace mpf
