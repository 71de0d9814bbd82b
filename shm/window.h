// SPDX-License-Identifier: MIT
// Window: the memory that a process exposes on the backplane, as a VME board exposed its
// dual-ported memory.
//
//   OwnWindow    our window segment (written only by us, locked while we run), our hints segment
//                and a FIFO for event loops
//   PeerWindow   the window of another process, mapped read-only, and its hints, mapped read-write
//
// Threads  OwnWindow: one owner thread, but ring() may be called by any thread and by a signal
//          handler. PeerWindow: any thread.
// Crash    the kernel releases the lock. A process that needs the name, or attaches to the
//          backplane, removes the files.
// Trust    a peer can write only the hints.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include <mpf/wait_mode.h>

#include "shm/doorbell.h"
#include "shm/fork_guard.h"
#include "shm/segment.h"

namespace mpf {

// Throws NameInUse at once if a running process has the name of a server window. The constructor of
// OwnWindow first gives this process some time to end.
//   throws  NameInUse, and SegmentError if a process uses a file that is not a usable window
void checkNameIsFree(const std::string& name);

class OwnWindow {
 public:
  // `describe` fills in name, location and geometry before the window gets its name.
  //   name    file name of a server window; empty: a client window, named by its incarnation
  //   throws  NameInUse, SegmentError if a file that is not a usable window has the name,
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

  // Whether another process has removed the name, so that new peers cannot find the window.
  [[nodiscard]] bool isNameless() const noexcept { return !window_.hasName(); }

  // Lets a server write the hints and the FIFO. `peers` are the rights of the link to this server.
  // Rights are only added. If no single user or group covers all of them, every user gets them.
  //   throws  std::system_error when this process may not give a file to that group or user
  void admit(const Rights& peers);

  // Wakes the owner. Async-signal-safe.
  void ring() const noexcept;

 private:
  void publish(const std::string& name);
  ForkGuard forkGuard_;
  Rights rights_;
  Rights admitted_;  // of the hints
  Segment window_;
  Segment hints_;
  std::string fifoName_;
  FileDescriptor fifo_;
};

class PeerWindow {
 public:
  // Maps a window and its hints; nullptr if one of them does not exist (any more).
  //   throws  SegmentError, std::system_error
  static std::shared_ptr<PeerWindow> tryOpen(const std::string& name, layout::SegmentKind kind);

  [[nodiscard]] const layout::SegmentHeader& header() const noexcept { return window_.header(); }
  [[nodiscard]] const layout::WindowControl& control() const noexcept {
    return window_.at<layout::WindowControl>(layout::kWindowControlOffset);
  }
  [[nodiscard]] const std::string& name() const noexcept { return window_.name(); }

  // Notifies the owner that link `index` has a message or a change of state, and wakes it if it
  // sleeps. The message or the change must have been stored before.
  void notify(std::uint32_t index) noexcept;
  // Fetches the lines that notify() needs, for a caller that will probably notify soon. Any thread.
  void expectNotify(std::uint32_t index) const noexcept;
  // Asks the owner to accept link `incarnation`.
  void knock(std::uint64_t incarnation) noexcept;
  // Makes the next notification ring even if we have rung for this sleep already. For a caller that
  // has waited long: another process may have consumed its ring.
  void forceNextRing() noexcept { rungFor_.store(0, std::memory_order_relaxed); }

  // Set by the watcher when the owner is proven dead, and never reset.
  [[nodiscard]] bool isDead() const noexcept {
    // PAIR(peer-dead): also sees the last states of the peer's links.
    return dead_.load(std::memory_order_acquire);
  }
  void setDead() noexcept {
    // PAIR(peer-dead): the watcher has seen that the owner gave up its window.
    dead_.store(true, std::memory_order_release);
  }
  // Whether one of its files was truncated. Its contents are then meaningless.
  [[nodiscard]] bool isLost() const noexcept { return window_.isLost() || hints_.isLost(); }
  // Asks the kernel whether the owner is alive.
  [[nodiscard]] bool hasOwner() const noexcept;
  // Whether a process holds the owner's lock: the owner, or a child that it made without the
  // handlers of fork().
  [[nodiscard]] bool isLocked() const noexcept { return window_.isLocked(); }
  // Called once, by the watcher.
  void setProcess(FileDescriptor process) noexcept { process_ = std::move(process); }
  // Becomes readable when the owner's process ends; empty before setProcess(), and if this process
  // cannot find it.
  [[nodiscard]] const FileDescriptor& process() const noexcept { return process_; }
  [[nodiscard]] std::uint32_t user() const noexcept { return window_.fileUser(); }
  [[nodiscard]] bool isClosed() const noexcept {
    // PAIR(window-closed): also sees the messages that the owner sent before. Its links may still
    // be open.
    return control().state.load(std::memory_order_acquire) == layout::WindowState::closed;
  }

 private:
  void wakeIfAsleep() noexcept;
  bool tryRing(layout::SleepState sleeping) noexcept;
  [[nodiscard]] layout::WindowHints& hints() const noexcept {
    return hints_.at<layout::WindowHints>(0);
  }
  Segment window_;
  Segment hints_;
  FileDescriptor process_;
  std::string fifoName_;
  std::mutex fifoMutex_;
  FileDescriptor fifo_;  // opened when the owner first sleeps on its descriptor
  // number of the owner's last sleep for which this process has rung
  std::atomic<std::uint64_t> rungFor_{0};
  std::atomic<bool> dead_{false};
};

}  // namespace mpf
