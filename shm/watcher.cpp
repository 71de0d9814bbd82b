// SPDX-License-Identifier: MIT
#include "shm/watcher.h"

#include <pthread.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/inotify.h>
#include <sys/timerfd.h>

#include <array>
#include <cstring>
#include <exception>
#include <new>
#include <utility>
#include <vector>

#include "base/signals_blocked.h"
#include "base/step.h"
#include "base/system_call.h"
#include "base/timespec.h"
#include "shm/process.h"
#include "shm/segment_name.h"

namespace mpf {
namespace {

constexpr Watcher::Token kStop = 1;
constexpr Watcher::Token kTimer = 2;
constexpr Watcher::Token kNames = 3;
constexpr long kPollNs = 100'000'000;

// Closes an inotify instance in a thread of its own: this takes the kernel some 15 ms, in which the
// watcher's thread could not report a death.
void closeElsewhere(FileDescriptor names) noexcept try {
  const SignalsBlocked blocked;
  std::thread([closing = std::move(names)] {}).detach();
  // NOLINTNEXTLINE(bugprone-empty-catch): no thread could be started: closed here
} catch (const std::exception&) {
}

bool tryAdd(int epoll, int fd, Watcher::Token token) noexcept {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.u64 = token;
  return ::epoll_ctl(epoll, EPOLL_CTL_ADD, fd, &event) == 0;
}

void add(int epoll, int fd, Watcher::Token token) {
  if (!tryAdd(epoll, fd, token)) throwSystemError(errno, "epoll_ctl", "");
}

// The letters of the kinds of new names of the backplane in an inotify buffer; "*" if the queue
// overflowed and names were lost.
std::string kindsIn(const char* events, std::size_t bytes, const std::string& backplane) {
  std::string kinds;
  for (std::size_t at = 0; at < bytes;) {
    inotify_event event{};
    std::memcpy(&event, events + at, sizeof event);
    const auto* name = events + at + sizeof event;
    if ((event.mask & IN_Q_OVERFLOW) != 0) return "*";
    if (event.len != 0) {
      const auto parsed = SegmentName::tryParse(name);
      if (parsed && parsed->backplane == backplane) kinds += static_cast<char>(parsed->kind);
    }
    at += sizeof event + event.len;
  }
  return kinds;
}

}  // namespace

Watcher::Watcher(std::string backplane)
    : backplane_(std::move(backplane)),
      epoll_(checkCall(::epoll_create1(EPOLL_CLOEXEC), "epoll_create1")),
      stop_(checkCall(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK), "eventfd")),
      timer_(checkCall(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK),
                       "timerfd_create")) {
  add(epoll_.get(), stop_.get(), kStop);
  add(epoll_.get(), timer_.get(), kTimer);
}

Watcher::~Watcher() {
  if (isInherited()) {
    ForkGuard::abandon(thread_);
  } else if (thread_.joinable()) {
    ::eventfd_write(stop_.get(), 1);
    thread_.join();
  }
}

void Watcher::start() {
  if (thread_.joinable()) return;
  const SignalsBlocked blocked;
  thread_ = std::thread([this] {
    ::pthread_setname_np(::pthread_self(), "mpf-watcher");
    run();
  });
}

Watcher::Token Watcher::addPeer(std::shared_ptr<PeerWindow> peer, Callback callback) {
  const std::lock_guard lock(mutex_);
  start();
  const auto token = next_++;
  peers_.emplace(token, Peer{std::move(peer), std::move(callback)});
  ++polledPeers_;
  updateTimer();
  return token;
}

void Watcher::watchProcess(Token token) noexcept {
  std::shared_ptr<PeerWindow> window;
  {
    const std::lock_guard lock(mutex_);
    const auto found = peers_.find(token);
    if (found == peers_.end()) return;  // already reported
    window = found->second.window;
  }
  auto process = Process::openOwner(window->header());
  const std::lock_guard lock(mutex_);
  const auto found = peers_.find(token);
  if (found == peers_.end()) return;
  if (!process || !tryAdd(epoll_.get(), process.get(), token)) return pollAtOnce();
  window->setProcess(std::move(process));
  found->second.isPolled = false;
  --polledPeers_;
  updateTimer();
}

Watcher::Token Watcher::watchPeer(std::shared_ptr<PeerWindow> peer, Callback callback) {
  const auto token = addPeer(std::move(peer), std::move(callback));
  watchProcess(token);
  return token;
}

Watcher::Token Watcher::watchNames(NameKind kind, Callback callback) {
  const std::lock_guard lock(mutex_);
  start();
  if (nameCallbacks_.empty()) openNames();
  const auto token = next_++;
  nameCallbacks_.emplace(token, Names{kind, std::move(callback)});
  updateTimer();
  return token;
}

// A user has few inotify instances (128 by default). Therefore the watcher has one only while a
// caller waits for names, and polls if no instance is free.
void Watcher::openNames() {
  names_.reset(::inotify_init1(IN_CLOEXEC | IN_NONBLOCK));
  if (!names_) return;
  if (::inotify_add_watch(names_.get(), segments::path("").c_str(), IN_CREATE) < 0)
    return names_.reset();
  add(epoll_.get(), names_.get(), kNames);
}

// Before a peer is removed: others may keep its window, and with it the descriptor of its process.
void Watcher::unwatch(const Peer& peer) noexcept {
  if (peer.isPolled) --polledPeers_;
  else ::epoll_ctl(epoll_.get(), EPOLL_CTL_DEL, peer.window->process().get(), nullptr);
}

void Watcher::forget(Token token) {
  if (isInherited()) return;  // the epoll instance is shared with the parent
  const std::lock_guard lock(mutex_);
  if (const auto found = peers_.find(token); found != peers_.end()) {
    unwatch(found->second);
    peers_.erase(found);
  }
  if (nameCallbacks_.erase(token) != 0 && nameCallbacks_.empty() && names_) {
    ::epoll_ctl(epoll_.get(), EPOLL_CTL_DEL, names_.get(), nullptr);
    closeElsewhere(std::move(names_));
  }
  updateTimer();
}

void Watcher::run() {
  std::array<epoll_event, 32> events{};
  for (;;) {
    const auto count =
        ::epoll_wait(epoll_.get(), events.data(), static_cast<int>(events.size()), -1);
    for (int i = 0; i < count; ++i) {
      const auto token = events[static_cast<std::size_t>(i)].data.u64;
      if (token == kStop) return;
      const std::lock_guard lock(mutex_);
      try {
        handle(token);
      } catch (const std::bad_alloc&) {
        retry();
      }
    }
  }
}

// The timer, which may not run, calls poll() once more.
void Watcher::retry() noexcept {
  const itimerspec spec{.it_interval = timespecOf(kPollNs), .it_value = timespecOf(kPollNs)};
  ::timerfd_settime(timer_.get(), 0, &spec, nullptr);
  polls_ = true;
}

void Watcher::handle(Token token) {
  if (token == kTimer) {
    poll();
  } else if (token == kNames) {
    readNames();
  } else if (const auto found = peers_.find(token); found != peers_.end()) {
    report(token);
  }
}

bool Watcher::isGone(const Peer& peer) const {
  return peer.window->isClosed() || !peer.window->hasOwner();
}

void Watcher::report(Token token) {
  const auto found = peers_.find(token);
  unwatch(found->second);
  const auto peer = std::move(found->second);
  peers_.erase(found);
  updateTimer();
  peer.window->setDead();
  MPF_STEP(death_noticed);
  peer.callback();
}

// Reads at most one buffer, then returns and releases the mutex: a user that floods /dev/shm with
// names cannot keep other threads from it.
void Watcher::readNames() {
  alignas(inotify_event) std::array<char, 4096> events;
  const auto got = ::read(names_.get(), events.data(), events.size());
  if (got <= 0) return;
  const bool wereLost = std::exchange(areNamesLost_, true);
  const auto kinds = kindsIn(events.data(), static_cast<std::size_t>(got), backplane_);
  const bool someLost = wereLost || kinds.find('*') != std::string::npos;
  notifyNames([&](NameKind kind) {
    return someLost || kinds.find(static_cast<char>(kind)) != std::string::npos;
  });
  areNamesLost_ = false;
}

void Watcher::notifyNames(const std::function<bool(NameKind)>& isNew) {
  auto callbacks = nameCallbacks_;  // a copy, because a callback may call forget()
  for (const auto& [token, names] : callbacks) {
    if (isNew(names.kind) && nameCallbacks_.contains(token)) names.callback();
  }
}

void Watcher::poll() {
  std::uint64_t expirations = 0;
  [[maybe_unused]] const auto got = ::read(timer_.get(), &expirations, sizeof expirations);
  std::vector<Token> gone;
  for (const auto& [token, peer] : peers_) {
    if (peer.isPolled && isGone(peer)) gone.push_back(token);
  }
  for (const auto token : gone) {
    if (peers_.contains(token)) report(token);
  }
  if (!names_ || areNamesLost_) notifyNames([](NameKind) { return true; });
  areNamesLost_ = false;
  updateTimer();
}

void Watcher::pollAtOnce() {
  const itimerspec spec{.it_interval = timespecOf(kPollNs), .it_value = timespecOf(1)};
  ::timerfd_settime(timer_.get(), 0, &spec, nullptr);
  polls_ = true;
}

// Does not restart a running timer: frequent changes must not delay it.
void Watcher::updateTimer() {
  const bool needed = polledPeers_ != 0 || (!names_ && !nameCallbacks_.empty());
  if (needed == polls_) return;
  polls_ = needed;
  itimerspec spec{};
  if (needed) spec.it_value = spec.it_interval = timespecOf(kPollNs);
  ::timerfd_settime(timer_.get(), 0, &spec, nullptr);
}

}  // namespace mpf
