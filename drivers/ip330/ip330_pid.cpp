// SPDX-License-Identifier: MIT
#include "drivers/ip330/ip330_pid.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/ip330/ip330_scan.h"

namespace mpf {

Ip330Pid::Ip330Pid(Ip330& board, int channel, AnalogOutput& output, double lowest, double highest,
                   Ip330Faults::Hook hook)
    : board_(board), channel_(channel), output_(output), hook_(std::move(hook)) {
  expectIp330Channels(board, channel, channel);
  loop_.lowLimit = lowest;
  loop_.highLimit = highest;
  subscription_ = board.subscribe([this](const Ip330Sample& sample) { take(sample); });
}

int Ip330Pid::scansPerStep() const {
  const double period = board_.microsecondsPerScan();
  return period > 0 ? static_cast<int>(std::clamp(std::round(seconds_ * 1e6 / period), 1.0, 1e9))
                    : 1;
}

void Ip330Pid::take(const Ip330Sample& sample) {
  bool isFailing = false;
  {
    const std::lock_guard lock(mutex_);
    isValid_ = sample.isValid(channel_);
    if (!isValid_) return;
    sum_ += sample.corrected[static_cast<std::size_t>(channel_)];
    if (++scans_ < scansPerStep()) return;
    isFailing = !step(std::exchange(sum_, 0) / std::exchange(scans_, 0));
    if (std::exchange(isFailing_, isFailing) == isFailing) return;
  }
  if (hook_)
    hook_(isFailing ? "the output of the feedback does not answer"
                    : "the output of the feedback answers again",
          isFailing);
}

// Returns false when the output does not answer; it then keeps its value.
bool Ip330Pid::step(double actual) {
  if (isWanted_ && !loop_.isOn()) {
    const auto now = output_.tryRead();
    if (!now) return false;
    loop_.turnOn(*now);
  }
  const double output = loop_.step(actual, scansPerStep() * board_.microsecondsPerScan() / 1e6);
  if (!loop_.isOn() || output_.tryWrite(output)) return true;
  loop_.turnOff();  // feedback continues from the present output later
  return false;
}

void Ip330Pid::start() {
  const std::lock_guard lock(mutex_);
  isWanted_ = true;
}

void Ip330Pid::stop() {
  const std::lock_guard lock(mutex_);
  isWanted_ = false;
  loop_.turnOff();
}

void Ip330Pid::set(const std::function<void(PidLoop&)>& change) {
  const std::lock_guard lock(mutex_);
  change(loop_);
}

bool Ip330Pid::trySetSecondsPerScan(double seconds) {
  if (!std::isfinite(seconds) || seconds < 0) return false;
  const std::lock_guard lock(mutex_);
  seconds_ = seconds;
  sum_ = 0;
  scans_ = 0;
  return true;
}

Ip330Pid::Status Ip330Pid::status() {
  const std::lock_guard lock(mutex_);
  return {.terms = loop_.terms(),
          .secondsPerScan = scansPerStep() * board_.microsecondsPerScan() / 1e6,
          .isGood = board_.isDelivering() && isValid_ && !isFailing_};
}

}  // namespace mpf
