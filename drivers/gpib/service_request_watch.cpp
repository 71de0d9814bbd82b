// SPDX-License-Identifier: MIT
#include "drivers/gpib/service_request_watch.h"

#include <utility>

#include <mpf/clock.h>

#include "base/signals_blocked.h"

namespace mpf {

ServiceRequestWatch::ServiceRequestWatch(std::function<std::optional<bool>()> isActive,
                                         std::chrono::milliseconds every)
    : isActive_(std::move(isActive)), every_(every) {
  const SignalsBlocked blocked;
  thread_ = std::thread([this] { run(); });
}

ServiceRequestWatch::~ServiceRequestWatch() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void ServiceRequestWatch::report() {
  {
    const std::lock_guard lock(mutex_);
    hasReport_ = true;
  }
  changed_.notify_one();
}

void ServiceRequestWatch::setReported(bool isReported) {
  const std::lock_guard lock(mutex_);
  isControllerReporting_ = isReported;
}

std::shared_ptr<void> ServiceRequestWatch::add(std::function<void()> handler) {
  auto entry = handlers_.add(std::move(handler));
  {
    const std::lock_guard lock(mutex_);
    hasNewHandler_ = true;
  }
  changed_.notify_one();
  return entry;
}

void ServiceRequestWatch::run() {
  for (bool isActive = false, isUnknown = false;;) {
    const bool hasHandlers = !handlers_.isEmpty();
    bool isReported = false;
    {
      std::unique_lock lock(mutex_);
      const auto isCalled = [this] { return ends_ || hasReport_ || hasNewHandler_; };
      const bool looksAgain = hasHandlers && (isActive || isUnknown || !isControllerReporting_);
      const auto again = looksAgain ? Deadline::after(every_) : Deadline::never();
      if (again.isNever()) changed_.wait(lock, isCalled);
      else changed_.wait_for(lock, again.left(), isCalled);
      if (ends_) return;
      hasNewHandler_ = false;
      isReported = std::exchange(hasReport_, false);
    }
    const auto line = isReported || handlers_.isEmpty() ? std::optional(isReported) : isActive_();
    isUnknown = !line;  // the bus was busy; the controller may have reported the line before
    isActive = line.value_or(isActive);
    if (isActive) handlers_.call();
  }
}

}  // namespace mpf
