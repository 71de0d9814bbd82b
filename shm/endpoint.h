// SPDX-License-Identifier: MIT
// Endpoint: a window and the links that end at it; waits for the next message of any of the links.
//
//   next   HotLinks: poll the busy links ─► ReadyBits: look at links with hints
//   wait   the same for a while (SpinBudget), unless SharedProcessor says to sleep at once ─►
//          announce the sleep, look again, sleep
//   control events, which are not of a link: Knocks, and local events such as a death (PeerWindows)
//
// Idle links cost nothing, however many there are: the endpoint looks at a link that it does not
// poll only when its ready bit is set. Links take turns; a server takes one message in a turn, or a
// run of up to 16, a dispatcher up to 16 messages or runs.
//
// Threads  one owner thread; interrupt() may be called by any thread and by a signal handler.
// Crash    the watcher reports a peer's death as a local event: takeLocalEvent(), takePeerDeath().
// Trust    a ready bit may be missing or set without reason: the endpoint looks at every link
//          before a sleep, or, if it has many, every 100 ms. An event loop with many links looks at
//          them only in an arm() 100 ms after the last look: a message whose bit a faulty peer has
//          cleared may wait for the next event. Clients with unanswered requests cause one.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <mpf/backplane.h>

#include "shm/hot_links.h"
#include "shm/knocks.h"
#include "shm/link.h"
#include "shm/peer_windows.h"
#include "shm/ready_bits.h"
#include "shm/shared_processor.h"
#include "shm/spin_budget.h"

namespace mpf {

class Endpoint {
 public:
  // The parameters of OwnWindow, and how wait() waits.
  Endpoint(Backplane backplane, layout::SegmentKind kind, const std::string& name, Rights rights,
           WaitMode mode, const std::function<void(layout::SegmentHeader&)>& describe);
  Endpoint(const Endpoint&) = delete;
  Endpoint& operator=(const Endpoint&) = delete;

  [[nodiscard]] const Backplane& backplane() const noexcept { return backplane_; }
  [[nodiscard]] OwnWindow& window() noexcept { return window_; }
  [[nodiscard]] const ForkGuard& forkGuard() const noexcept { return window_.forkGuard(); }
  [[nodiscard]] layout::WindowControl& control() const noexcept { return window_.control(); }
  // The windows of the peers. The death of a peer is reported as a local event.
  [[nodiscard]] PeerWindows& peers() noexcept { return peers_; }

  // --- links ---
  // Reserves an index (the bit of a new link); nullopt if all are in use.
  //   throws  std::bad_alloc
  std::optional<std::uint32_t> tryReserve();
  // Adds the link of a reserved index. The endpoint owns neither it nor its user.
  void attach(std::uint32_t index, Link& link, LinkUser& user);
  // Removes the link and frees its index.
  void detach(std::uint32_t index) noexcept;
  // Ignores messages of this link until release(). The index stays reserved.
  void hold(std::uint32_t index) noexcept;
  void release(std::uint32_t index, Link& link) noexcept;

  // --- events ---
  // A link that may have a message or a change of state; nullptr if there is no such link now. The
  // caller takes one message of this link.
  Link* next() noexcept {
    if (auto* const link = nextPolled()) return link;
    return nextOther();
  }
  // The two halves of next(). A link that nextPolled() returns has a message. It returns nothing
  // when no polled link has one, and after kHintsEvery turns. The caller then calls nextOther(); it
  // may handle control events before.
  [[gnu::always_inline]] Link* nextPolled() noexcept {
    if (polledLeft_ == 0) return nullptr;
    auto* const link = hot_.next();
    if (link != nullptr) --polledLeft_;
    return link;
  }
  // Also settles the windows of new peers.
  Link* nextOther() noexcept;
  // The caller has taken further messages in the same turn; they count as turns.
  void countTurns(std::uint32_t more) noexcept { polledLeft_ -= std::min(more, polledLeft_); }
  // Whether there may be an event that is not one of a link: a knock, a rescan or a local event.
  // Cheap: three loads.
  [[nodiscard]] bool hasControlEvents() const noexcept {
    return knocks_.hasAny() || localEvent_.load(std::memory_order_relaxed) != 0;
  }
  // Clients that ask to be accepted.
  [[nodiscard]] Knocks& knocks() noexcept { return knocks_; }
  // True after an event in this process: a peer died, a server appeared, interrupt() was called.
  bool takeLocalEvent() noexcept {
    // PAIR(local-event): sees everything that happened before interrupt().
    return localEvent_.load(std::memory_order_relaxed) != 0 &&
           localEvent_.exchange(0, std::memory_order_acquire) != 0;
  }
  // After takeLocalEvent() returned true: whether a peer died. Its links have peer()->isDead().
  bool takePeerDeath() noexcept { return peerDied_.exchange(false, std::memory_order_relaxed); }

  // Waits until next() may return a link, or hasControlEvents() is true. Returns false if
  // `deadline` passed first.
  bool wait(Deadline deadline) noexcept;
  // Ends the current or the next wait().
  void interrupt() noexcept;

  // For event loops: a descriptor that is readable after an event. Call arm() before each poll() of
  // it. If arm() returns false, there is an event already: do not wait.
  [[nodiscard]] int descriptor() const noexcept { return window_.fifo().get(); }
  bool arm() noexcept;
  void disarm() noexcept;
  // While the owner polls next() and hasControlEvents(), arm() announces no sleep and returns true:
  // peers need not wake the owner, and the descriptor does not become readable.
  void setPolled(bool isPolled) noexcept { isPolled_ = isPolled; }
  // Makes the descriptor readable again: the caller has not handled all events.
  void keepReadable() noexcept { window_.ring(); }

  // The caller has measured the duration of a wake-up.
  void noteWake(std::int64_t ns) noexcept { spinBudget_.noteWake(ns); }
  // Whether the last wait() slept.
  [[nodiscard]] bool slept() const noexcept { return slept_; }

 private:
  Link* nextReady() noexcept;
  Link* nextCold() noexcept;
  [[nodiscard]] bool isAttached(std::uint32_t index) const noexcept {
    return index < links_.size() && links_[index] != nullptr;
  }
  void countLinks(std::int32_t more) noexcept;
  [[nodiscard]] bool hasEvents() const noexcept;
  [[nodiscard]] bool isRevisitDue() const noexcept;
  bool spin(Deadline deadline) noexcept;
  bool foundByPolling() noexcept;
  void announce(layout::SleepState how) noexcept;
  void sleep(Deadline deadline) noexcept;
  bool tryScanAllLinks() noexcept;

  Backplane backplane_;
  OwnWindow window_;
  WaitMode mode_;
  std::vector<Link*> links_;
  std::vector<std::uint32_t> freeIndices_;
  ReadyBits readyBits_;
  HotLinks hot_;
  Knocks knocks_;
  // Turns of polled links before a round of the ready links; 0 in that round and while armed.
  std::uint32_t polledLeft_ = 0;
  std::uint32_t sinceScan_ = 0;  // looks at the hints since the last scan of all links
  // A link that is not polled and may have further messages after the one that was taken.
  std::optional<std::uint32_t> revisit_;
  std::atomic<std::uint32_t> localEvent_{0};
  std::atomic<bool> peerDied_{false};
  bool armed_ = false;
  bool isPolled_ = false;
  std::uint64_t sleepNumber_ = 0;  // number of the last sleep that was announced
  bool slept_ = false;
  SpinBudget spinBudget_;
  SharedProcessor processor_;
  std::int64_t scannedAllNs_ = 0;  // time of the last scan of all links
  PeerWindows peers_;  // the last member: destroyed first, because deaths interrupt()
};

}  // namespace mpf
