// SPDX-License-Identifier: MIT
#include "server/programs/serial_server/line_faults.h"

#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <utility>
#include <vector>

#include <mpf/serial_commands.h>

namespace mpf {
namespace {

// NOLINTNEXTLINE(google-build-using-namespace): all constants of <mpf/serial_commands.h>
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

LineFaults::LineFaults(MessageServer& server, const SerialPort& port, const ServerLog& log)
    : server_(server), port_(port), log_(log), start_(counted()), reported_(start_) {}

LineFaults::~LineFaults() { look(); }

LineFaults::Counts LineFaults::counted() const {
  const auto counters = port_.counters();
  return {counters.overruns, counters.parityErrors, counters.framingErrors, counters.breaks};
}

void LineFaults::look() {
  const std::lock_guard lock(mutex_);
  const auto now = counted();
  const auto alarms = now.sum() - std::exchange(reported_, now).sum();
  if (alarms == 0) return;
  for (std::uint64_t i = 0; i < std::min(alarms, kMostAlarmsAtOnce); ++i) server_.countAlarm();
  log_->warn("{}: the line lost or damaged bytes; since the server started: {}",
             port_.description(), textOf(now - start_));
}

std::string LineFaults::textOf(const Counts& counts) {
  std::vector<std::string> kinds;
  if (counts.overruns > 0) kinds.push_back(withCount(counts.overruns, "overrun", "overruns"));
  if (counts.parity > 0) kinds.push_back(withCount(counts.parity, "parity error", "parity errors"));
  if (counts.framing > 0)
    kinds.push_back(withCount(counts.framing, "framing error", "framing errors"));
  if (counts.breaks > 0) kinds.push_back(withCount(counts.breaks, "break", "breaks"));
  auto text = fmt::format("{}", fmt::join(kinds, ", "));
  if (counts.overruns > 0)
    text +=
        "; the program was not scheduled in time: `mpf doctor` shows how to allow real-time "
        "priority";
  if (counts.parity + counts.framing > 0)
    text +=
        "; check that both ends have the same baud rate, parity and stop bits, and check the cable";
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
