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

  // The window of this name; nullptr if there is no open one whose owner is alive.
  //   throws  as PeerWindow::tryOpen()
  std::shared_ptr<PeerWindow> tryOpen(const std::string& name, layout::SegmentKind kind);

 private:
  struct Peer {
    std::weak_ptr<PeerWindow> window;
    Watcher::Token token;
  };
  void dropUnused() noexcept;

  ForkGuard forkGuard_;
  Backplane backplane_;
  std::function<void()> onDeath_;
  // By name: the current window, and older windows of the name whose links have not ended yet.
  std::multimap<std::string, Peer> peers_;
};

}  // namespace mpf
