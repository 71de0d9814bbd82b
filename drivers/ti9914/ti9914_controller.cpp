// SPDX-License-Identifier: MIT
#include "drivers/ti9914/ti9914_controller.h"

#include <algorithm>
#include <fmt/format.h>
#include <stdexcept>
#include <utility>

#include "drivers/gpib/bus_lines.h"

namespace mpf {
namespace {

using Chip = Ti9914Chip;

// For the commands that end an operation after its deadline.
constexpr std::chrono::microseconds kGrace{300};
// Also read when no module answers.
constexpr std::uint8_t kAllLines = 0xff;
// A bus that never pauses is looked at for the deadline after so many bytes.
constexpr std::size_t kBytesOfLook = 64;

}  // namespace

Ti9914Controller::Ti9914Controller(IndustryPackModule& module, const Chip::Options& options)
    : GpibBoardController(OwnAddress::implied),
      module_(module),
      chip_(module, options, [this] { serviceRequested(); }) {
  if (const auto problem = setUp(); !problem.empty())
    throw std::runtime_error(lost(problem).reason);
}

std::string Ti9914Controller::description() const {
  return fmt::format("TI9914 {} ({})", module_.name(), module_.where());
}

// ---- states

std::string Ti9914Controller::setUp() {
  hasByteOnBus_ = false;
  drivesAttention_ = true;
  return chip_.setUp();
}

// Sets up a module that was absent.
GpibResult Ti9914Controller::prepare() {
  if (!chip_.isLost()) return {};
  const auto problem = setUp();
  return problem.empty() ? GpibResult{} : lost(problem);
}

// ATN comes first: without a listener, the talker would go on and lose bytes.
void Ti9914Controller::takeControl() {
  if (std::exchange(drivesAttention_, true)) return;
  chip_.forget(Chip::kCanSend | Chip::kNoAcceptor);
  chip_.command(ti9914::kTca);
  chip_.setState(ti9914::kLon, false);
  chip_.setState(ti9914::kTon, false);
}

void Ti9914Controller::releaseAttention() {
  chip_.command(ti9914::kGts);
  drivesAttention_ = false;
}

void Ti9914Controller::recover(Bytes closing) {
  if (!hasByteOnBus_ && !chip_.isLost() && command(closing, Deadline::after(kGrace)).ok()) return;
  // A module that does not answer now is reported by the next operation.
  static_cast<void>(setUp());
}

GpibResult Ti9914Controller::interfaceClear(Deadline /*deadline*/) {
  if (auto problem = prepare(); !problem.ok()) return problem;
  takeControl();
  chip_.pulseInterfaceClear();
  return {};
}

GpibResult Ti9914Controller::remoteEnable(bool on, Deadline /*deadline*/) {
  if (auto problem = prepare(); !problem.ok()) return problem;
  chip_.setState(ti9914::kSre, on);
  return {};
}

// ---- to the instruments

GpibResult Ti9914Controller::command(Bytes commands, Deadline deadline) {
  if (auto problem = prepare(); !problem.ok()) return problem;
  takeControl();
  return transmit(commands, true, false, deadline);
}

GpibResult Ti9914Controller::send(Bytes data, bool sendEnd, Deadline deadline) {
  chip_.forget(Chip::kCanSend | Chip::kNoAcceptor);
  chip_.setState(ti9914::kTon, true);
  releaseAttention();
  return transmit(data, false, sendEnd, deadline);
}

GpibResult Ti9914Controller::transmit(Bytes bytes, bool attention, bool sendEnd,
                                      Deadline deadline) {
  const auto isEnd = [&](std::size_t at) { return sendEnd && at + 1 == bytes.size(); };
  for (std::size_t accepted = 0;; ++accepted) {
    const auto events = wait(Chip::kCanSend | Chip::kNoAcceptor, deadline);
    if ((events & Chip::kCanSend) == 0)
      return notAccepted(events, attention, accepted, bytes.size());
    hasByteOnBus_ = false;
    if (accepted > 0)
      peek_.add(bytes[accepted - 1], attention, isEnd(accepted - 1), GpibDirection::sent);
    if (accepted == bytes.size()) break;
    if (accepted % kBytesOfLook == kBytesOfLook - 1 && deadline.hasPassed())
      return notAccepted(0, attention, accepted, bytes.size());
    if (isEnd(accepted)) chip_.command(ti9914::kFeoi);
    hasByteOnBus_ = true;
    chip_.write(bytes[accepted]);
  }
  peek_.flush();
  return {};
}

GpibResult Ti9914Controller::notAccepted(std::uint32_t events, bool attention, std::size_t at,
                                         std::size_t count) {
  peek_.flush();
  if ((events & Chip::kLost) != 0) return lost(module_.problem());
  if ((events & Chip::kNoAcceptor) != 0) {
    chip_.command(ti9914::kNbaf);
    hasByteOnBus_ = false;
    return {GpibStatus::noListener,
            attention ? "no instrument is on the bus: check the cable, and switch one on"
                      : "no instrument accepts data: check the address, and switch it on"};
  }
  return {GpibStatus::timeout,
          fmt::format("{} byte {} of {} was not accepted in time; active lines: {}",
                      attention ? "command" : "data", std::max(at, std::size_t{1}), count,
                      namesOfLines(chip_.lines()))};
}

// ---- from the instruments

GpibReadResult Ti9914Controller::receive(const GpibReadLimits& limits, Deadline deadline) {
  chip_.forget(Chip::kHasByte | Chip::kEnd);
  chip_.setState(ti9914::kHdfa, limits.endOfString.has_value() || limits.maxBytes == 1);
  chip_.setState(ti9914::kHdfe, true);
  chip_.command(ti9914::kRhdf);
  chip_.setState(ti9914::kLon, true);
  releaseAttention();
  GpibReadResult result;
  static_cast<GpibResult&>(result) = takeBytes(limits, deadline, result);
  takeControl();
  if (result.status == GpibStatus::timeout) {
    // A byte may have come just before ATN.
    if (const auto events = chip_.poll(Chip::kHasByte); (events & Chip::kHasByte) != 0)
      takeByte(events, result);
  }
  peek_.flush();
  return result;
}

// Ends with the talker held off, except after a timeout.
GpibResult Ti9914Controller::takeBytes(const GpibReadLimits& limits, Deadline deadline,
                                       GpibReadResult& result) {
  auto& data = result.data;
  for (;;) {
    const bool isLate = data.size() % kBytesOfLook == kBytesOfLook - 1 && deadline.hasPassed();
    const auto events = isLate ? 0 : wait(Chip::kHasByte, deadline);
    if ((events & Chip::kLost) != 0) return lost(module_.problem());
    if ((events & Chip::kHasByte) == 0)
      return {GpibStatus::timeout,
              fmt::format("the instrument sent {} bytes and then nothing in time; active lines: {}",
                          data.size(), namesOfLines(chip_.lines()))};
    if (data.size() + 2 == limits.maxBytes) chip_.setState(ti9914::kHdfa, true);
    takeByte(events, result);
    if (result.sawEnd || data.size() == limits.maxBytes || data.back() == limits.endOfString)
      return {};
    if (limits.endOfString) chip_.command(ti9914::kRhdf);
  }
}

void Ti9914Controller::takeByte(std::uint32_t events, GpibReadResult& result) {
  result.sawEnd = (events & Chip::kEnd) != 0;
  result.data.push_back(chip_.read());
  peek_.add(result.data.back(), false, result.sawEnd, GpibDirection::received);
}

// ---- events

std::uint32_t Ti9914Controller::wait(std::uint32_t wanted, Deadline deadline) {
  const auto events = chip_.poll(wanted);
  if ((events & (wanted | Chip::kLost)) != 0) return events;
  peek_.flush();
  return chip_.waitFor(wanted, deadline);
}

GpibResult Ti9914Controller::lost(const std::string& problem) const {
  return {GpibStatus::failure,
          fmt::format("GPIB controller {}: {}", module_.name(),
                      problem.empty() ? "the module did not answer for a while" : problem)};
}

std::optional<bool> Ti9914Controller::requestsService(Deadline /*deadline*/) {
  if (!prepare().ok()) return std::nullopt;
  const auto lines = chip_.lines();
  if (lines == kAllLines && !module_.problem().empty()) return std::nullopt;
  return (lines & gpib_line::kSrq) != 0;
}

bool Ti9914Controller::onServiceRequest(std::function<void()> handler) {
  const std::lock_guard lock(handlerMutex_);
  serviceHandler_ = std::move(handler);
  return true;
}

void Ti9914Controller::serviceRequested() {
  const std::lock_guard lock(handlerMutex_);
  if (serviceHandler_) serviceHandler_();
}

}  // namespace mpf
