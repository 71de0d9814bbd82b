// SPDX-License-Identifier: MIT
// PeerWindows: the windows of the peers of an endpoint: each is mapped once, watched, and unmapped
// when no link uses it any more.
//
// Threads  one owner thread.
// Crash    when a peer dies, the watcher's thread removes the files of its window and then calls
//          `onDeath`; PeerWindow::isDead() is true before that.
// Trust    as PeerWindow.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include <mpf/backplane.h>

#include "shm/watcher.h"
#include "shm/window.h"

namespace mpf {

class PeerWindows {
 public:
  // `onDeath` may run until the destructor returns.
  PeerWindows(Backplane backplane, std::function<void()> onDeath);
  ~PeerWindows();
  PeerWindows(const PeerWindows&) = delete;
  PeerWindows& operator=(const PeerWindows&) = delete;

  // The window of this name; nullptr if no window of this name is open and locked.
  //   throws  as PeerWindow::tryOpen() and Watcher::addPeer()
  std::shared_ptr<PeerWindow> tryOpen(const std::string& name, layout::SegmentKind kind);
  // Finishes what tryOpen() has begun, after the peer was told of the link, so that both work at
  // the same time: from now on the death of an owner is reported at once, before that within 100
  // ms. Unmaps the windows that no link uses. Cheap when no window was opened since the last call.
  void settle() noexcept {
    if (std::exchange(hasNew_, false)) settleAll();
  }
  // At the end of a link: unmaps the window of a living peer if nothing else uses it. Otherwise it
  // is unmapped after the last use, by settle() if the peer lives.
  void release(std::shared_ptr<PeerWindow> window) noexcept;

 private:
  struct Peer {
    std::weak_ptr<PeerWindow> window;
    Watcher::Token token = 0;  // 0: not watched, and not used by a link
    bool isWatchedClosely = false;
  };
  using Peers = std::multimap<std::string, Peer>;
  void settleAll() noexcept;
  void dropUnused(Peers::iterator from, Peers::iterator to) noexcept;

  ForkGuard forkGuard_;
  Backplane backplane_;
  std::function<void()> onDeath_;
  // By name: the current window, and older windows of the name whose links have not ended yet.
  Peers peers_;
  bool hasNew_ = false;  // a window was opened since the last settle()
};

}  // namespace mpf
