// SPDX-License-Identifier: MIT
#include <mpf/drivers/industry_pack/interrupt_thread.h>

#include <poll.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <array>
#include <utility>

#include <mpf/real_time_priority.h>

#include "base/signals_blocked.h"
#include "base/system_call.h"
#include "base/timespec.h"

namespace mpf {
namespace {

constexpr std::chrono::milliseconds kPollWhilePaused{100};
constexpr int kSpuriousCompensated = 2;  // by an interrupt with a request
constexpr int kPausesToCalm = 2;         // after them a line that was enabled again is calm

}  // namespace

InterruptThread::InterruptThread(Interrupt& interrupt, InterruptThreadOptions options,
                                 Handler handler, FaultHandler onFault)
    : interrupt_(interrupt),
      options_(options),
      handler_(std::move(handler)),
      onFault_(std::move(onFault)),
      wakeUp_(checkCall(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK), "eventfd",
                        "for an interrupt thread")),
      isPolled_(interrupt_.isPolled()) {  // a carrier that polls from the start reports that itself
  const SignalsBlocked blocked;
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

InterruptThread::~InterruptThread() {
  thread_.request_stop();
  wake();
  thread_.join();
  interrupt_.disable();
}

void InterruptThread::wake() noexcept { ::eventfd_write(wakeUp_.get(), 1); }

InterruptThread::Counters InterruptThread::counters() const noexcept {
  const auto count = [](const std::atomic<std::uint64_t>& counter) {
    return counter.load(std::memory_order_relaxed);
  };
  return {.interrupts = count(interrupts_),
          .spurious = count(spurious_),
          .late = count(late_),
          .storms = count(storms_)};
}

void InterruptThread::run(const std::stop_token& stop) {
  RealTimePriority priority(interrupt_.priority());
  resume();
  while (!stop.stop_requested()) {
    wait();
    if (stop.stop_requested()) return;
    if (interrupt_.take() > 0) {
      serveInterrupt();
    } else if (stormEnds_.hasPassed()) {
      endStorm();
    }
    eventfd_t wakes = 0;
    const bool isWoken = ::eventfd_read(wakeUp_.get(), &wakes) == 0;
    if (isWoken || pollAt_.hasPassed()) servePoll();
    if (isPaused() && pausedUntil_.hasPassed()) resume();
    followPolling();
    priority.check();
  }
}

void InterruptThread::serveInterrupt() {
  interrupts_.fetch_add(1, std::memory_order_relaxed);
  lateInRow_ = 0;
  if (handler_(Cause::interrupt)) {
    spuriousExcess_ = std::max(0, spuriousExcess_ - kSpuriousCompensated);
  } else {
    spurious_.fetch_add(1, std::memory_order_relaxed);
    if (++spuriousExcess_ >= options_.stormLimit) return pause();
  }
  interrupt_.enable();
}

void InterruptThread::servePoll() {
  if (handler_(Cause::poll)) {
    late_.fetch_add(1, std::memory_order_relaxed);
    if (!isPaused() && lateInRow_ < options_.lateLimit) {
      ++lateInRow_;
      if (lateInRow_ == options_.lateLimit) report(InterruptFault::dead);
    }
  }
  const auto period =
      isPaused() && options_.pollEvery.count() == 0 ? kPollWhilePaused : options_.pollEvery;
  pollAt_ = period.count() == 0 ? Deadline::never() : Deadline::after(period);
}

// The carrier has masked the line when the interrupt came; it stays masked during the pause.
void InterruptThread::pause() {
  storms_.fetch_add(1, std::memory_order_relaxed);
  pausedUntil_ = Deadline::after(options_.stormPause);
  stormEnds_ = Deadline::never();
  if (!isStorming_.exchange(true, std::memory_order_relaxed)) report(InterruptFault::storm);
  servePoll();
}

void InterruptThread::resume() {
  spuriousExcess_ = lateInRow_ = 0;
  pausedUntil_ = Deadline::never();
  if (isStorming()) stormEnds_ = Deadline::after(kPausesToCalm * options_.stormPause);
  pollAt_ =
      options_.pollEvery.count() == 0 ? Deadline::never() : Deadline::after(options_.pollEvery);
  interrupt_.enable();
}

// Called only when no interrupt is pending, so that a stuck line is not taken for a calm one when
// this thread did not run for some time.
void InterruptThread::endStorm() {
  stormEnds_ = Deadline::never();
  isStorming_.store(false, std::memory_order_relaxed);
}

void InterruptThread::followPolling() {
  if (isPolled_ || !interrupt_.isPolled()) return;
  isPolled_ = true;
  report(InterruptFault::polled);
}

void InterruptThread::report(InterruptFault fault) const {
  if (onFault_) onFault_(fault);
}

void InterruptThread::wait() const {
  std::array<pollfd, 2> events{{{.fd = interrupt_.descriptor(), .events = POLLIN, .revents = 0},
                                {.fd = wakeUp_.get(), .events = POLLIN, .revents = 0}}};
  const auto next = std::min({pollAt_, pausedUntil_, stormEnds_});
  const auto timeout = timespecOf(next.left());
  ::ppoll(events.data(), events.size(), next.isNever() ? nullptr : &timeout, nullptr);
}

}  // namespace mpf
