// SPDX-License-Identifier: MIT
#include "drivers/serial/line_keeper.h"

#include <algorithm>
#include <fmt/format.h>
#include <utility>

namespace mpf {
namespace {

constexpr Nanoseconds kFirstBackoff = std::chrono::milliseconds(20);
constexpr Nanoseconds kLastBackoff = std::chrono::seconds(1);

}  // namespace

pollfd LineKeeper::waitsFor() const noexcept {
  return phase_ == Phase::closed ? pollfd{-1, 0, 0} : line_->waitsFor();
}

Deadline LineKeeper::wakeAt() const noexcept {
  return phase_ == Phase::open ? Deadline::never() : attemptAt_;
}

void LineKeeper::service(short readyEvents) {
  if (phase_ == Phase::open) return;
  if (phase_ == Phase::closed && attemptAt_.hasPassed()) {
    attemptAt_ = Deadline::after(line_->openTimeout());
    return proceed();
  }
  if (phase_ == Phase::opening && readyEvents != 0) return proceed();
  if (phase_ == Phase::opening && attemptAt_.hasPassed()) {
    retryLater(fmt::format("{}: no answer within {} ms", line_->description(),
                           line_->openTimeout().count()));
  }
}

void LineKeeper::proceed() {
  switch (line_->tryOpen()) {
    case SerialLine::OpenState::opening:
      phase_ = Phase::opening;
      break;
    case SerialLine::OpenState::failed:
      retryLater(line_->problem());
      break;
    case SerialLine::OpenState::open:
      phase_ = Phase::open;
      openedAtNs_ = Clock::nowNs();
      publish(SerialPortState::plugged, {});
      break;
  }
}

void LineKeeper::lose() {
  if (Clock::nowNs() - openedAtNs_ > kLastBackoff.count()) backoff_ = {};
  retryLater(line_->problem());
}

void LineKeeper::retryLater(const std::string& reason) {
  line_->close();
  phase_ = Phase::closed;
  backoff_ = std::clamp(2 * backoff_, kFirstBackoff, kLastBackoff);
  attemptAt_ = Deadline::after(backoff_);
  publish(SerialPortState::unplugged, reason);
}

void LineKeeper::publish(SerialPortState state, const std::string& reason) {
  const std::lock_guard lock(mutex_);
  const bool changes = state_ != state;
  state_ = state;
  reason_ = reason;
  attempted_ = true;
  changed_.notify_all();
  if (changes && stateHandler_) stateHandler_(state, reason);
}

void LineKeeper::onStateChange(StateHandler handler) {
  const std::lock_guard lock(mutex_);
  stateHandler_ = std::move(handler);
}

SerialPortState LineKeeper::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

std::string LineKeeper::unpluggedBecause() const {
  const std::lock_guard lock(mutex_);
  return reason_;
}

bool LineKeeper::waitForState(SerialPortState state, Deadline deadline) const {
  std::unique_lock lock(mutex_);
  const auto reached = [&] { return state_ == state; };
  if (!deadline.isNever()) return changed_.wait_for(lock, deadline.left(), reached);
  changed_.wait(lock, reached);
  return true;
}

std::string LineKeeper::waitForFirstAttempt() const {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return attempted_; });
  return reason_;
}

}  // namespace mpf
