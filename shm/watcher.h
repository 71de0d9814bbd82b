// SPDX-License-Identifier: MIT
// Watcher: one thread of a process that tells when a peer has died and when a server or a pending
// bind has appeared. It sleeps all the time, and begins when there is somebody to watch.
//
//   pidfd readable ─► lock of the peer's window free? ─► dead: callback, once
//   /dev/shm gets a new name ─► callback for those who wait for its kind: clients for a server, routers for a pending bind
//
// Threads  any thread may call; callbacks run on the watcher's thread and must not wait.
// Crash    what it cannot see by a pidfd (another pid namespace, a pid taken over) it sees by
//          asking for the lock every 100 ms. So it does with names when the kernel has no inotify
//          instance left for this user.
// Trust    a peer's pid is only a hint where to look; the kernel's lock is the proof.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include <mpf/file_descriptor.h>

#include "shm/fork_guard.h"
#include "shm/segment_name.h"
#include "shm/window.h"

namespace mpf {

class Watcher {
 public:
  using Callback = std::function<void()>;
  using Token = std::uint64_t;

  // Of the names in /dev/shm, those of this backplane are news.
  explicit Watcher(std::string backplane);
  ~Watcher();

  // Calls back once when the owner of `peer` is proven dead (then peer->isDead()) or its window is
  // gone.
  Token watchPeer(std::shared_ptr<PeerWindow> peer, Callback callback);
  // Calls back whenever a segment of this kind may have appeared.
  Token watchNames(NameKind kind, Callback callback);
  // After return the callback does not run and will not run again.
  void forget(Token token);
  [[nodiscard]] bool isInherited() const noexcept { return forkGuard_.isInherited(); }

 private:
  struct Peer {
    std::shared_ptr<PeerWindow> window;
    Callback callback;
    FileDescriptor process;  // empty: polled
  };
  void start();
  void run();
  void handle(Token token);
  bool isGone(const Peer& peer) const;
  void report(Token token);
  void openNames();
  void readNames();
  struct Names {
    NameKind kind;
    Callback callback;
  };
  void tellOfNames(const std::function<bool(NameKind)>& isNew);
  void poll();
  void pollAtOnce();
  void updateTimer();

  ForkGuard forkGuard_;
  std::string backplane_;
  FileDescriptor epoll_;
  FileDescriptor stop_;
  FileDescriptor timer_;
  FileDescriptor names_;  // inotify, while somebody waits for names; empty: polled
  std::recursive_mutex mutex_;  // callbacks run under it, so that forget() can promise what it does
  Token next_ = 16;  // below: our own descriptors
  std::map<Token, Peer> peers_;
  std::map<Token, Names> nameCallbacks_;
  bool polls_ = false;  // the timer runs
  std::thread thread_;
};

}  // namespace mpf
