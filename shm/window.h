// SPDX-License-Identifier: MIT
// Window: what a process exposes on the backplane, as a VME board exposed its dual-ported memory.
//
//   OwnWindow    window segment (ours to write, locked for life) + hints segment + FIFO for event
//                loops
//   PeerWindow   the same of another process: window read-only, hints read-write
//
// Threads  OwnWindow: one owner thread, but ring() may be called by any thread and by a signal
//          handler. PeerWindow: any thread.
// Crash    the kernel drops the lock; whoever needs the name removes what is left.
// Trust    a peer can write hints only.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include <mpf/wait_mode.h>

#include "shm/doorbell.h"
#include "shm/fork_guard.h"
#include "shm/segment.h"

namespace mpf {

class OwnWindow {
 public:
  // `describe` fills in name, location and geometry before anybody can see the window.
  //   name    file name of a server window; empty: a client window, named by its incarnation
  //   throws  NameInUse, SegmentError when something that is no window has the name,
  //           std::system_error
  OwnWindow(const std::string& backplane, layout::SegmentKind kind, const std::string& name,
            Rights rights, const std::function<void(layout::SegmentHeader&)>& describe);
  ~OwnWindow();
  OwnWindow(const OwnWindow&) = delete;
  OwnWindow& operator=(const OwnWindow&) = delete;

  [[nodiscard]] const layout::SegmentHeader& header() const noexcept { return window_.header(); }
  [[nodiscard]] layout::WindowControl& control() const noexcept {
    return window_.at<layout::WindowControl>(layout::kWindowControlOffset);
  }
  [[nodiscard]] layout::WindowHints& hints() const noexcept {
    return hints_.at<layout::WindowHints>(0);
  }
  [[nodiscard]] Rights rights() const noexcept { return rights_; }
  [[nodiscard]] const FileDescriptor& fifo() const noexcept { return fifo_; }
  [[nodiscard]] const ForkGuard& forkGuard() const noexcept { return forkGuard_; }

  // Whether somebody took its name away: who comes now does not find it.
  [[nodiscard]] bool isNameless() const {
    return segments::probeOwner(window_.name(), header().incarnation) == segments::Owner::absent;
  }

  // Lets the processes of a server write the hints and the pipe: those that have these rights to
  // the link. Rights are only added; when no single user or group has them all, everybody gets
  // them.
  //   throws  std::system_error when this process may not give a file to that group or user
  void admit(const Rights& peers);

  // Wakes the owner. Async-signal-safe.
  void ring() const noexcept;

 private:
  void publish(const std::string& name);
  ForkGuard forkGuard_;
  std::string backplane_;
  Rights rights_;
  Rights admitted_;  // of the hints
  Segment window_;
  Segment hints_;
  FileDescriptor fifo_;
};

class PeerWindow {
 public:
  // nullptr when there is no such window (any more).
  //   throws  SegmentError, std::system_error
  static std::shared_ptr<PeerWindow> tryOpen(const std::string& name, layout::SegmentKind kind);

  [[nodiscard]] const layout::SegmentHeader& header() const noexcept { return window_.header(); }
  [[nodiscard]] const layout::WindowControl& control() const noexcept {
    return window_.at<layout::WindowControl>(layout::kWindowControlOffset);
  }
  [[nodiscard]] const std::string& name() const noexcept { return window_.name(); }

  // Tells the owner that link `index` has news, and wakes it if it sleeps. The news must have been
  // stored before.
  void notify(std::uint32_t index) noexcept;
  // Asks the owner to accept link `incarnation`.
  void knock(std::uint64_t incarnation) noexcept;
  // The next news rings, whatever was rung before: for who waits for long, and whose ring may have
  // been taken by somebody else.
  void forceNextRing() noexcept { rungFor_.store(0, std::memory_order_relaxed); }

  // Set by the watcher once the owner is proven dead; stays.
  [[nodiscard]] bool isDead() const noexcept { return dead_.load(std::memory_order_relaxed); }
  void setDead() noexcept { dead_.store(true, std::memory_order_relaxed); }
  // Whether somebody cut its files: what we see of it means nothing any more.
  [[nodiscard]] bool isLost() const noexcept { return window_.isLost() || hints_.isLost(); }
  // Asks the kernel: whether the owner is alive.
  [[nodiscard]] bool hasOwner() const noexcept { return window_.hasOwner(); }
  [[nodiscard]] std::uint32_t user() const { return window_.fileUser(); }
  [[nodiscard]] bool isClosed() const noexcept {
    return control().state.load(std::memory_order_relaxed) == layout::WindowState::closed;
  }

 private:
  void wakeIfAsleep() noexcept;
  bool tryRing(layout::SleepState sleeping) noexcept;
  [[nodiscard]] layout::WindowHints& hints() const noexcept {
    return hints_.at<layout::WindowHints>(0);
  }
  Segment window_;
  Segment hints_;
  std::string fifoName_;
  std::mutex fifoMutex_;
  FileDescriptor fifo_;  // opened when the owner first sleeps on its descriptor
  // the number of the owner's sleep for which this process has rung last
  std::atomic<std::uint64_t> rungFor_{0};
  std::atomic<bool> dead_{false};
};

}  // namespace mpf
