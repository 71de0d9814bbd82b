// SPDX-License-Identifier: MIT
#include "client/dispatcher_impl.h"

#include <pthread.h>

#include <algorithm>
#include <utility>

#include "base/signals_blocked.h"
#include "client/last_callbacks.h"

namespace mpf {
namespace {

constexpr int kBatch = 16;  // messages of one link before the next link has its turn
constexpr std::uint32_t kWakeupsPerClockCheck = 64;  // wake-ups without work between clock readings

class DepthGuard {
 public:
  explicit DepthGuard(std::uint32_t& depth) noexcept : depth_(depth) { ++depth_; }
  ~DepthGuard() { --depth_; }
  DepthGuard(const DepthGuard&) = delete;
  DepthGuard& operator=(const DepthGuard&) = delete;

 private:
  std::uint32_t& depth_;
};

}  // namespace

Dispatcher::Impl::Impl(Backplane backplane, const DispatcherOptions& options)
    : parts_(std::move(backplane), layout::SegmentKind::clientWindow, std::string(), kReadableByAll,
             options.waitMode, [&](layout::SegmentHeader& header) {
               options.label.copy(header.name.data(), header.name.size() - 1);
             }) {}

Dispatcher::Impl::~Impl() {
  if (endpoint().forkGuard().isInherited()) return;
  // PAIR(window-closed): the messages that were sent before.
  endpoint().control().state.store(layout::WindowState::closed, std::memory_order_release);
}

void Dispatcher::Impl::startThread(const std::shared_ptr<Impl>& self) {
  last_callbacks::prepare();
  const SignalsBlocked blocked;
  hasThread_ = true;
  thread_ = std::thread([held = std::shared_ptr(self)]() mutable {
    ::pthread_setname_np(::pthread_self(), "mpf-dispatcher");
    held->runThread();
    const bool isLast = held->endsAfterCallback_;
    held.reset();
    if (isLast) last_callbacks::end();
  });
}

void Dispatcher::Impl::runThread() {
  const auto guard = acquireLock();
  while (!ended_.load(std::memory_order_relaxed)) {
    try {
      runOnce(Deadline::atNs(parts_.errors.dueNs()));
    } catch (...) {  // thrown by a callback; this thread has no caller that could handle it
      endpoint().control().alarms.fetch_add(1, std::memory_order_relaxed);
      parts_.errors.report();
    }
    parts_.errors.writeDue();
  }
  parts_.errors.writeHeld();
}

void Dispatcher::Impl::endThread() {
  if (!thread_.joinable()) return;
  if (endpoint().forkGuard().isInherited()) return ForkGuard::abandon(thread_);
  ended_.store(true, std::memory_order_relaxed);
  interrupt();
  // A callback may destroy the last client: then this thread ends after the callback.
  if (parts_.lock.isMine()) {
    endsAfterCallback_ = true;
    last_callbacks::begin();
    thread_.detach();
  } else {
    thread_.join();
  }
}

void Dispatcher::Impl::remove(Binding& binding) {
  const auto command = [this, &binding] {
    binding.leave();
    bindings_.remove(binding);
    if (depth_ == 0) bindings_.dropRemoved();
    else hasPostponed_ = true;
  };
  parts_.commands.runOrWait(command, hasThread_);
}

// interrupt() ends the calls of all depths: the innermost one takes it, and leaves it to the outer
// ones. A callback may go on to run the dispatcher in its depth.
bool Dispatcher::Impl::takeStopOf(std::uint32_t depth) noexcept {
  auto stop = stop_.load(std::memory_order_relaxed);
  while (stop > depth && !stop_.compare_exchange_weak(stop, depth, std::memory_order_relaxed)) {
  }
  return stop > depth;
}

bool Dispatcher::Impl::runOnce(Deadline deadline) {
  const auto guard = becomeRunner();
  if (takeStop()) return false;
  // Tries one step before preparing to wait, because often a message has already arrived.
  return step() || run(deadline, [this] { return takeStop(); });
}

bool Dispatcher::Impl::tryRunUntil(Deadline deadline, const std::function<bool()>& isDone) {
  const bool isNested = parts_.lock.isMine();
  if (!isNested &&
      (hasThread_ || parts_.lock.hasOtherRunner() || !parts_.lock.tryAcquireTemporarily()))
    return false;
  const RunnerGuard guard(isNested ? nullptr : &parts_.lock);
  const auto isOver = [&] { return !isNested && parts_.lock.isRunnerWaiting(); };
  while (!isDone() && !deadline.hasPassed() && !isOver()) run(deadline, isOver);
  if (hasDescriptor_) endpoint().keepReadable();  // running has made it unreadable
  return true;
}

// Returns true when it has done something, false at the deadline and when isOver() returns true.
template <class IsOver>
[[gnu::noinline]] bool Dispatcher::Impl::run(Deadline deadline, const IsOver& isOver) {
  parts_.timer.setWaitingThread();
  for (std::uint32_t wakeups = 0;;) {
    // Checked even when every step finds work: a busy dispatcher must stop, too.
    if (isOver()) return false;
    if (step()) return true;
    // step() also took the event of any interrupt() since the check above, so check again before
    // waiting.
    if (isOver()) return false;
    dropKnocks();
    const bool hasWoken = endpoint().wait(std::min(deadline, nextDue()));
    // Faulty peers may set hints without end, so the clock is read even when wait() returns true.
    if ((!hasWoken || ++wakeups % kWakeupsPerClockCheck == 0) && deadline.hasPassed() &&
        !nextDue().hasPassed())
      return false;
  }
}

// Only servers accept clients: a knock at a client window is invalid.
void Dispatcher::Impl::dropKnocks() noexcept {
  for (std::uint32_t knocks = 0; knocks < layout::kKnocks && endpoint().knocks().tryTake();
       ++knocks) {
  }
  static_cast<void>(endpoint().knocks().takeRescan());
}

// When a callback throws, the interrupt() makes the next wait return immediately, so that the next
// step handles the remaining work.
[[gnu::always_inline]] inline bool Dispatcher::Impl::step() try { return tryStep(); } catch (...) {
  endpoint().interrupt();
  throw;
}

// Inline, because it is on the path of each message.
[[gnu::always_inline]] inline bool Dispatcher::Impl::tryStep() {
  if (hasPostponed_ && depth_ == 0) handlePostponed();
  const DepthGuard inside(depth_);
  const bool hasActed = endpoint().takeLocalEvent() && handleLocalHints();
  return takeFrom(endpoint().nextPolled()) || tryOthers() || hasActed;
}

// Handles everything but messages of polled links. nextPolled() returns nothing after some turns,
// so a busy dispatcher gets here, too.
bool Dispatcher::Impl::tryOthers() {
  const bool hasResumed = bindings_.resume();
  const bool hasActed = takeFrom(endpoint().nextOther()) || hasResumed;
  if (!parts_.timer.isDue()) return hasActed;
  bindings_.handleDue();
  return true;
}

// A binding that a callback removes stays alive until the next step.
[[gnu::always_inline]] inline bool Dispatcher::Impl::takeFrom(Link* link) {
  return link != nullptr && static_cast<Binding&>(link->user()).takeSome(kBatch);
}

void Dispatcher::Impl::interrupt() noexcept {
  stop_.store(kAll, std::memory_order_relaxed);
  endpoint().interrupt();
}

int Dispatcher::Impl::descriptor() {
  const auto guard = becomeRunner();
  hasDescriptor_ = true;
  static_cast<void>(endpoint().arm());
  return endpoint().descriptor();
}

bool Dispatcher::Impl::runPending(int most) {
  const bool isDone = runSome(most);
  if (!isDone && hasDescriptor_) endpoint().keepReadable();
  return isDone;
}

bool Dispatcher::Impl::runSome(int most) {
  const auto guard = becomeRunner();
  parts_.timer.setWaitingThread();
  // Peers may send messages and hints without end: the event loop must have its turn.
  for (int batches = 0; batches < most; ++batches) {
    if (step()) continue;
    dropKnocks();
    if (!hasDescriptor_ || endpoint().arm()) return true;
  }
  return false;
}

// Handles commands, deaths of peers and new names. Returns true when callbacks may have run, or the
// next step has work.
bool Dispatcher::Impl::handleLocalHints() {
  const bool hasCalled = parts_.commands.hasCommands();
  if (hasCalled) parts_.commands.run();
  if (endpoint().takePeerDeath()) bindings_.noteDeath();
  if (parts_.names.takeChange()) bindings_.noteName();
  if (!parts_.commands.hasWaiting()) return hasCalled;
  hasPostponed_ = true;
  return true;
}

// What waits until no callback is in progress: a callback may run the dispatcher. Bindings whose
// callback is in progress stay alive, and threads that destroy a client wait for its end.
[[gnu::noinline]] void Dispatcher::Impl::handlePostponed() noexcept {
  hasPostponed_ = false;
  bindings_.dropRemoved();
  parts_.commands.runWaiting();
}

}  // namespace mpf
