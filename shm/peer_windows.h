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

  // The window of this name; nullptr if there is no open one whose owner holds its lock.
  //   throws  as PeerWindow::tryOpen() and Watcher::addPeer()
  std::shared_ptr<PeerWindow> tryOpen(const std::string& name, layout::SegmentKind kind);
  // Lets the death of the owner of a window from tryOpen() be reported at once; until then it is
  // reported within 100 ms. A step of its own, to be taken while the peer works on the new link,
  // because it takes about as long as the opening.
  void watchClosely(const PeerWindow& window) noexcept;
  // At the end of a link: unmaps the window if this was the last use. Otherwise a later tryOpen()
  // does.
  void release(std::shared_ptr<PeerWindow> window) noexcept;

 private:
  struct Peer {
    std::weak_ptr<PeerWindow> window;
    Watcher::Token token;
    bool isWatchedClosely = false;
  };
  using Peers = std::multimap<std::string, Peer>;
  void dropUnused(Peers::iterator from, Peers::iterator to) noexcept;

  ForkGuard forkGuard_;
  Backplane backplane_;
  std::function<void()> onDeath_;
  // By name: the current window, and older windows of the name whose links have not ended yet.
  Peers peers_;
};

}  // namespace mpf
