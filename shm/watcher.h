// SPDX-License-Identifier: MIT
// Watcher: one thread of a process that reports the death of peers, and new servers and pending
// binds. The thread starts at the first watch and sleeps until an event.
//
//   pidfd of the peer's window is readable ─► dead: callback, once
//   new name in /dev/shm ─► callbacks for its kind (clients: servers; routers: pending binds)
//
// Threads  any thread may call; callbacks run on the watcher's thread and must not block.
// Crash    as long as a peer has no pidfd here (before watchProcess(), another pid namespace, a
//          reused pid, no free descriptor), the watcher asks for its owner every 100 ms. Likewise,
//          it calls the callbacks for names every 100 ms if the user has no free inotify instance.
//          What it could not report for lack of memory, it reports up to 100 ms later.
// Trust    the pid of a window is from a header that its owner alone writes. Without a pidfd, the
//          kernel's lock is the proof.
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

  // Reports only names of this backplane.
  explicit Watcher(std::string backplane);
  ~Watcher();

  // Calls `callback` once, within 100 ms after the owner of `peer`, which is not watched yet, has
  // died or closed its window, or after this call if that happened before. Then peer->isDead() is
  // true.
  //   throws  std::system_error: no thread can be started; std::bad_alloc
  Token addPeer(std::shared_ptr<PeerWindow> peer, Callback callback);
  // Reports the death of this peer at once from now on, if its process can be opened. To be called
  // once for a peer, by the thread that uses its window.
  void watchProcess(Token token) noexcept;
  // Both steps.
  Token watchPeer(std::shared_ptr<PeerWindow> peer, Callback callback);
  // Calls `callback` each time a segment of this kind may have appeared.
  Token watchNames(NameKind kind, Callback callback);
  // Ends a watch. After the return the callback does not run and will not run again.
  void forget(Token token);
  [[nodiscard]] bool isInherited() const noexcept { return forkGuard_.isInherited(); }

 private:
  struct Peer {
    std::shared_ptr<PeerWindow> window;
    Callback callback;
    bool isPolled = true;  // false: its process is in epoll_
  };
  void start();
  void run();
  void unwatch(const Peer& peer) noexcept;
  void handle(Token token);
  bool isGone(const Peer& peer) const;
  void report(Token token);
  void openNames();
  void readNames();
  void retry() noexcept;
  struct Names {
    NameKind kind;
    Callback callback;
  };
  void notifyNames(const std::function<bool(NameKind)>& isNew);
  void poll();
  void pollAtOnce();
  void updateTimer();

  ForkGuard forkGuard_;
  std::string backplane_;
  FileDescriptor epoll_;
  FileDescriptor stop_;
  FileDescriptor timer_;
  FileDescriptor names_;  // inotify, while a caller waits for names; empty: polled
  bool areNamesLost_ = false;  // names that were read have not been reported
  std::recursive_mutex mutex_;  // callbacks run under it, which makes the promise of forget() true
  Token next_ = 16;  // lower tokens: the watcher's own descriptors
  std::map<Token, Peer> peers_;
  std::size_t polledPeers_ = 0;
  std::map<Token, Names> nameCallbacks_;
  bool polls_ = false;  // whether the timer runs
  std::thread thread_;
};

}  // namespace mpf
