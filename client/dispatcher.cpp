// SPDX-License-Identifier: MIT
#include <mpf/dispatcher.h>

#include <pthread.h>

#include <algorithm>
#include <condition_variable>
#include <map>
#include <utility>

#include "base/signals_blocked.h"
#include "client/dispatcher_impl.h"

namespace mpf {
namespace {

constexpr int kBatch = 16;  // messages of one link before the next link has its turn
// The mode of a client window before its first connection: all users may read it, as tools and
// routers do.
constexpr mode_t kReadableByAll = 0644;
constexpr std::uint32_t kWakeupsPerClockCheck = 64;  // wake-ups without work between clock readings

class DepthGuard {
 public:
  explicit DepthGuard(int& depth) noexcept : depth_(depth) { ++depth_; }
  ~DepthGuard() { --depth_; }
  DepthGuard(const DepthGuard&) = delete;
  DepthGuard& operator=(const DepthGuard&) = delete;

 private:
  int& depth_;
};

}  // namespace

Dispatcher::Impl::Impl(Backplane backplane, const DispatcherOptions& options)
    : endpoint_(std::move(backplane), layout::SegmentKind::clientWindow, {},
                Rights{.mode = kReadableByAll}, options.waitMode,
                [&](layout::SegmentHeader& header) {
                  options.label.copy(header.name.data(), header.name.size() - 1);
                }) {}

Dispatcher::Impl::~Impl() {
  if (endpoint_.forkGuard().isInherited()) return;
  waitForNames(false);
  endpoint_.control().state.store(layout::WindowState::closed, std::memory_order_relaxed);
}

void Dispatcher::Impl::startThread(const std::shared_ptr<Impl>& self) {
  const SignalsBlocked blocked;
  hasThread_ = true;
  thread_ = std::thread([self] {
    ::pthread_setname_np(::pthread_self(), "mpf-dispatcher");
    const auto guard = self->acquireLock();
    while (!self->ended_.load(std::memory_order_relaxed)) {
      try {
        self->runOnce(Deadline::atNs(self->errors_.dueNs()));
      } catch (...) {  // thrown by a callback; this thread has no caller that could handle it
        self->endpoint_.control().alarms.fetch_add(1, std::memory_order_relaxed);
        self->errors_.report();
      }
      self->errors_.writeDue();
    }
    self->errors_.writeHeld();
  });
}

void Dispatcher::Impl::endThread() {
  if (!thread_.joinable()) return;
  if (endpoint_.forkGuard().isInherited()) return ForkGuard::abandon(thread_);
  ended_.store(true, std::memory_order_relaxed);
  interrupt();
  // A callback may destroy the last client: then this thread ends after the callback.
  if (lock_.isMine()) {
    thread_.detach();
  } else {
    thread_.join();
  }
}

// A client may be destroyed before the command that adds its binding runs.
void Dispatcher::Impl::add(const std::shared_ptr<Binding>& binding) {
  if (!binding->hasLeft()) bindings_.insert(binding);
}

void Dispatcher::Impl::remove(const std::shared_ptr<Binding>& binding) {
  bindings_.erase(binding);
  removed_.push_back(binding);
  if (namesToken_ == 0) return;
  // It may have been the last binding that waited for a server: then the watch of names can end.
  namesChanged_.store(true, std::memory_order_relaxed);
  endpoint_.interrupt();
}

RunnerGuard Dispatcher::Impl::becomeRunner() {
  endpoint_.forkGuard().check("Dispatcher");
  if (lock_.isMine()) return RunnerGuard(nullptr);
  if (hasThread_) RunnerLock::throwOtherRunner();
  return acquireLock();
}

RunnerGuard Dispatcher::Impl::acquireLock() {
  lock_.acquire([this] { endpoint_.interrupt(); });
  return RunnerGuard(&lock_);
}

bool Dispatcher::Impl::takeStop() noexcept {
  return stop_.load(std::memory_order_relaxed) && stop_.exchange(false, std::memory_order_relaxed);
}

bool Dispatcher::Impl::runOnce(Deadline deadline) {
  const auto guard = becomeRunner();
  return run(deadline, [this] { return takeStop(); });
}

bool Dispatcher::Impl::tryRunUntil(Deadline deadline, const std::function<bool()>& isDone) {
  const bool isNested = lock_.isMine();
  if (!isNested && (hasThread_ || lock_.hasOtherRunner() || !lock_.tryAcquireTemporarily()))
    return false;
  const RunnerGuard guard(isNested ? nullptr : &lock_);
  const auto isOver = [&] { return !isNested && lock_.isRunnerWaiting(); };
  while (!isDone() && !deadline.hasPassed() && !isOver()) run(deadline, isOver);
  if (hasDescriptor_) endpoint_.keepReadable();  // running has made it unreadable
  return true;
}

// Returns true when it has done something, false at the deadline and when isOver() returns true.
template <class IsOver>
bool Dispatcher::Impl::run(Deadline deadline, const IsOver& isOver) {
  const auto me = std::this_thread::get_id();
  // PAIR(waiting-thread): stored before this thread reads how long it may wait.
  if (waitingThread_.load(std::memory_order_relaxed) != me)
    waitingThread_.store(me, std::memory_order_seq_cst);
  for (std::uint32_t wakeups = 0;;) {
    // Checked even when every step finds work: a busy dispatcher must stop, too.
    if (isOver()) return false;
    if (step()) return true;
    // The step clears the local hints, and with them that of an interrupt() since the check above.
    if (isOver()) return false;
    dropKnocks();
    const bool hasWoken = endpoint_.wait(std::min(deadline, nextDue()));
    // Faulty peers may set hints without end, so the clock is read even when wait() returns true.
    if ((!hasWoken || ++wakeups % kWakeupsPerClockCheck == 0) && deadline.hasPassed() &&
        !nextDue().hasPassed())
      return false;
  }
}

// Only servers accept clients: a knock at a client window is invalid.
void Dispatcher::Impl::dropKnocks() noexcept {
  for (std::uint32_t knocks = 0; knocks < layout::kKnocks && endpoint_.knocks().tryTake();
       ++knocks) {
  }
  static_cast<void>(endpoint_.knocks().takeRescan());
}

// When a callback throws, the interrupt() makes the next wait return immediately, so that the next
// step handles the remaining work.
bool Dispatcher::Impl::step() try { return tryStep(); } catch (...) {
  endpoint_.interrupt();
  throw;
}

bool Dispatcher::Impl::tryStep() {
  // A callback may run the dispatcher, too: bindings whose callback is in progress stay alive.
  const DepthGuard inside(depth_);
  if (depth_ == 1) removed_.clear();
  bool hasActed = endpoint_.takeLocalEvent() && handleLocalHints();
  hasActed = resumeRounds() || hasActed;
  if (const auto index = endpoint_.next()) {
    auto* binding = *index < byIndex_.size() ? byIndex_[*index] : nullptr;
    int taken = 0;
    // A binding that a callback removes stays alive until the next step.
    while (binding != nullptr && taken < kBatch && binding->takeOne()) ++taken;
    if (taken != 0) return true;
  }
  if (dueNs_.load(std::memory_order_relaxed) == INT64_MAX || !nextDue().hasPassed())
    return hasActed;
  handleDue();
  return true;
}

void Dispatcher::Impl::interrupt() noexcept {
  stop_.store(true, std::memory_order_relaxed);
  endpoint_.interrupt();
}

int Dispatcher::Impl::descriptor() {
  hasDescriptor_ = true;
  static_cast<void>(endpoint_.arm());
  return endpoint_.descriptor();
}

bool Dispatcher::Impl::runPending(int most) {
  const auto guard = becomeRunner();
  // Peers may send messages and hints without end: the event loop must have its turn.
  for (int batches = 0; batches < most; ++batches) {
    if (step()) continue;
    dropKnocks();
    if (!hasDescriptor_ || endpoint_.arm()) return true;
  }
  if (hasDescriptor_) endpoint_.keepReadable();
  return false;
}

void Dispatcher::Impl::post(std::function<void()> command) {
  if (lock_.isMine()) return command();
  postLater(std::move(command));
}

void Dispatcher::Impl::postLater(std::function<void()> command) {
  {
    const std::lock_guard lock(commandMutex_);
    commands_.push_back(std::move(command));
    hasCommands_.store(true, std::memory_order_relaxed);
  }
  endpoint_.interrupt();
}

void Dispatcher::Impl::runOrPost(const std::function<void()>& command) {
  if (lock_.isMine()) return command();
  if (!lock_.tryAcquireTemporarily()) return postLater(command);
  const RunnerGuard guard(&lock_);
  command();
}

// The thread that runs the dispatcher may stop before it has seen the command; then the caller runs
// the command.
void Dispatcher::Impl::runOrPostAndWait(const std::function<void()>& command) {
  if (lock_.isMine()) return command();
  struct State {
    bool isStarted = false;  // under lock_
    bool isDone = false;  // under mutex
    std::mutex mutex;
    std::condition_variable changed;
  };
  const auto state = std::make_shared<State>();
  const auto runFirst = [state, &command] {
    if (std::exchange(state->isStarted, true)) return;
    command();
    const std::lock_guard lock(state->mutex);
    state->isDone = true;
    state->changed.notify_one();
  };
  const auto isDone = [&] { return state->isDone; };
  for (bool isPosted = false;; isPosted = true) {
    if (lock_.tryAcquireTemporarily()) {
      const RunnerGuard guard(&lock_);
      return runFirst();
    }
    if (!isPosted) postLater(runFirst);
    std::unique_lock lock(state->mutex);
    if (hasThread_) return state->changed.wait(lock, isDone);
    if (state->changed.wait_for(lock, kLookForRunner, isDone)) return;
  }
}

void Dispatcher::Impl::noteDue(std::int64_t ns) noexcept {
  auto due = dueNs_.load(std::memory_order_relaxed);
  // PAIR(waiting-thread): stored before this thread reads which thread waits.
  while (ns < due && !dueNs_.compare_exchange_weak(due, ns, std::memory_order_seq_cst,
                                                   std::memory_order_relaxed)) {
  }
  // PAIR(waiting-thread): the waiting thread reads the time stored above, or its id is read here.
  if (ns < due && waitingThread_.load(std::memory_order_seq_cst) != std::this_thread::get_id())
    endpoint_.interrupt();
}

void Dispatcher::Impl::noteThrower(const std::string& server, std::int32_t location) noexcept {
  if (hasThread_) errors_.note(server, location);
}

void Dispatcher::Impl::setLink(std::uint32_t index, Binding* binding) {
  if (index >= byIndex_.size()) byIndex_.resize(index + 1);
  byIndex_[index] = binding;
}

void Dispatcher::Impl::waitForNames(bool wait) {
  auto& watcher = endpoint_.backplane().watcher();
  if (wait && namesToken_ == 0) {
    namesToken_ = watcher.watchNames(NameKind::serverWindow, [this] {
      namesChanged_.store(true, std::memory_order_relaxed);
      endpoint_.interrupt();
    });
    // For a server that appeared before the watch began.
    namesChanged_.store(true, std::memory_order_relaxed);
    endpoint_.interrupt();
  } else if (!wait && namesToken_ != 0) {
    watcher.forget(namesToken_);
    namesToken_ = 0;
  }
}

// Handles commands, deaths of peers and new names. Returns true when callbacks may have run.
bool Dispatcher::Impl::handleLocalHints() {
  const bool hasCalled = hasCommands_.load(std::memory_order_relaxed);
  if (hasCalled) runCommands();
  if (endpoint_.takePeerDeath()) dead_.begin(bindings_);
  if (namesChanged_.exchange(false, std::memory_order_relaxed)) waiting_.begin(bindings_);
  return hasCalled;
}

// Returns true when a round was in progress.
bool Dispatcher::Impl::resumeRounds() {
  if (dead_.isOver() && waiting_.isOver()) return false;
  dead_.resume([](Binding& binding) {
    if (!binding.hasDeadPeer()) return false;
    binding.disconnect("the process of the server exited", Binding::Ending::serverGone);
    return true;
  });
  if (waiting_.isOver()) return true;
  waiting_.resume([](Binding& binding) {
    if (!binding.isWaiting()) return false;
    binding.tryConnect();
    return true;
  });
  if (waiting_.isOver())
    waitForNames(
        std::ranges::any_of(bindings_, [](const auto& binding) { return binding->isWaiting(); }));
  return true;
}

// Runs the commands that are posted now. Removes each before it runs: when it throws, the others
// stay posted.
void Dispatcher::Impl::runCommands() {
  std::size_t left = 0;
  {
    const std::lock_guard lock(commandMutex_);
    left = commands_.size();
  }
  for (; left != 0; --left) {
    const auto command = takeCommand();
    if (!command) return;  // a callback ran the dispatcher
    command();
  }
}

std::function<void()> Dispatcher::Impl::takeCommand() {
  const std::lock_guard lock(commandMutex_);
  if (commands_.empty()) return {};
  auto command = std::move(commands_.front());
  commands_.pop_front();
  hasCommands_.store(!commands_.empty(), std::memory_order_relaxed);
  return command;
}

void Dispatcher::Impl::handleDue() {
  if (due_.isOver()) {
    dueNs_.store(INT64_MAX, std::memory_order_relaxed);
    // PAIR(due): the round below sees a deadline that a sender stored before dueNs_ was reset; a
    // later sender lowers dueNs_ again.
    doorbell::fence();
    due_.begin(bindings_);
  }
  const auto nowNs = Clock::nowNs();
  try {
    due_.resume([nowNs](Binding& binding) {
      if (binding.dueNs() > nowNs) return false;
      binding.onTime(nowNs);
      return true;
    });
  } catch (...) {
    noteDue(nowNs);  // the next step handles the other bindings, and the rest of this one
    throw;
  }
  if (!due_.isOver()) return noteDue(nowNs);  // the next step continues the round
  for (const auto& binding : bindings_) noteDue(binding->dueNs());
}

Dispatcher::Dispatcher(const Backplane& backplane, const DispatcherOptions& options)
    : impl_(std::make_shared<Impl>(backplane, options)) {}
Dispatcher::~Dispatcher() { impl_->endThread(); }

std::shared_ptr<Dispatcher> Dispatcher::shared(const Backplane& backplane) {
  static std::mutex mutex;
  static std::map<std::string, std::weak_ptr<Dispatcher>> dispatchers;
  const std::lock_guard lock(mutex);
  auto& known = dispatchers[backplane.name()];
  auto dispatcher = known.lock();
  if (!dispatcher || dispatcher->impl_->endpoint().forkGuard().isInherited()) {
    dispatcher = std::make_shared<Dispatcher>(backplane);
    dispatcher->impl_->startThread(dispatcher->impl_);
    known = dispatcher;
  }
  return dispatcher;
}

bool Dispatcher::runOnce(Deadline deadline) { return impl_->runOnce(deadline); }
void Dispatcher::run() {
  const auto guard = impl_->becomeRunner();
  while (impl_->runOnce(Deadline::never())) {
  }
}
void Dispatcher::interrupt() noexcept { impl_->interrupt(); }
int Dispatcher::descriptor() { return impl_->descriptor(); }
bool Dispatcher::runPending(int batches) { return impl_->runPending(batches); }
Deadline Dispatcher::nextDeadline() const noexcept { return impl_->nextDue(); }
const Backplane& Dispatcher::backplane() const noexcept { return impl_->endpoint().backplane(); }

}  // namespace mpf
