// SPDX-License-Identifier: MIT
// Endpoint: a window and the links that end at it; waits for the next message of any of the links.
//
//   poll the busy links ─► read the ready bits ─► no message: spin for a while
//                                                 ─► announce the sleep, look again, sleep
//
// Idle links cost nothing, however many there are: the endpoint looks at a link that it does not
// poll only when its ready bit is set. Links take turns, one message each.
//
// Threads  one owner thread; interrupt() may be called by any thread and by a signal handler.
// Crash    the watcher reports a peer's death as a local event: takeLocalNews(), takePeerDeath().
// Trust    a ready bit may be missing or set without reason: before a sleep the endpoint looks at
//          every link.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include <mpf/backplane.h>

#include "shm/link.h"
#include "shm/watcher.h"

namespace mpf {

class Endpoint {
 public:
  // The parameters of OwnWindow, and how wait() waits.
  Endpoint(Backplane backplane, layout::SegmentKind kind, const std::string& name, Rights rights,
           WaitMode mode, const std::function<void(layout::SegmentHeader&)>& describe);
  ~Endpoint();
  Endpoint(const Endpoint&) = delete;
  Endpoint& operator=(const Endpoint&) = delete;

  [[nodiscard]] const Backplane& backplane() const noexcept { return backplane_; }
  [[nodiscard]] OwnWindow& window() noexcept { return window_; }
  [[nodiscard]] const ForkGuard& forkGuard() const noexcept { return window_.forkGuard(); }
  [[nodiscard]] layout::WindowControl& control() const noexcept { return window_.control(); }

  // --- links ---
  // Reserves an index (the bit of a new link); nullopt if all are in use.
  std::optional<std::uint32_t> tryReserve() noexcept;
  // Adds the link of a reserved index. The endpoint does not own it.
  void attach(std::uint32_t index, Link& link);
  // Removes the link and frees its index.
  void detach(std::uint32_t index) noexcept;
  // Ignores messages of this link until release(). The index stays reserved.
  void hold(std::uint32_t index) noexcept;
  void release(std::uint32_t index, Link& link) noexcept;
  // Returns the window of a peer, mapped once and watched; nullptr if there is no open window of
  // this name whose owner is alive. The owner's death is reported as a local event; then
  // peer()->isDead() of its links is true.
  //   throws  as PeerWindow::tryOpen()
  std::shared_ptr<PeerWindow> peer(const std::string& name, layout::SegmentKind kind);

  // --- events ---
  // Index of a link that may have a message or a change of state; nullopt if there is no such link
  // now. The caller takes one message of this link.
  std::optional<std::uint32_t> next() noexcept;
  // Whether takeKnock(), takeRescan() or takeLocalNews() may return something. Cheap: three loads.
  [[nodiscard]] bool hasSideNews() const noexcept {
    const auto& hints = window_.hints();
    return hints.knocked.load(std::memory_order_relaxed) != knockedSeen_ ||
           hints.rescan.load(std::memory_order_relaxed) != 0 ||
           localNews_.load(std::memory_order_relaxed) != 0 || knockCursor_ != layout::kKnocks;
  }
  // The incarnation of a link whose client asks the owner to accept it.
  std::optional<std::uint64_t> takeKnock() noexcept;
  // True if knocks were overwritten: the caller must search for new links by name.
  bool takeRescan() noexcept;
  // True after an event in this process: a peer died, a server appeared, interrupt() was called.
  bool takeLocalNews() noexcept;
  // After takeLocalNews() returned true: whether a peer died. Its links have peer()->isDead().
  bool takePeerDeath() noexcept { return peerDied_.exchange(false, std::memory_order_relaxed); }

  // Waits until next(), takeKnock(), takeRescan() or takeLocalNews() may return something. Returns
  // false if `deadline` passed first.
  bool wait(Deadline deadline) noexcept;
  // Ends the current or the next wait().
  void interrupt() noexcept;

  // For event loops: a descriptor that is readable after an event. Call arm() before each poll() of
  // it. If arm() returns false, there is an event already: do not wait.
  [[nodiscard]] int descriptor() const noexcept { return window_.fifo().get(); }
  bool arm() noexcept;
  void disarm() noexcept;
  // Makes the descriptor readable again: the caller has not handled all events.
  void callAgain() noexcept { window_.ring(); }

  // Updates the estimated duration of a wake-up with a measured one.
  void noteWake(std::int64_t ns) noexcept {
    wakeNs_ += (std::min<std::int64_t>(ns, 1'000'000) - wakeNs_) / 8;
  }
  // Whether the last wait() slept.
  [[nodiscard]] bool slept() const noexcept { return slept_; }

 private:
  // A link that is polled.
  struct Hot {
    std::uint32_t index;
    std::uint32_t misses;  // consecutive polls without a message
    Link* link;
  };
  static constexpr std::size_t kHotLinks = 8;

  std::optional<std::uint32_t> nextReady() noexcept;
  std::optional<std::uint32_t> nextCold() noexcept;
  std::optional<std::uint32_t> takeReadyBit(std::size_t word) noexcept;
  void heat(std::uint32_t index) noexcept;
  void cool(std::size_t position) noexcept;
  void coolLink(std::uint32_t index) noexcept;
  void coolAll() noexcept;
  void setReadyBit(std::uint32_t index) noexcept;
  [[nodiscard]] bool hasNews() const noexcept;
  [[nodiscard]] bool hasReadyWords() const noexcept;
  [[nodiscard]] bool isRevisitDue() const noexcept;
  [[nodiscard]] bool hasHints() const noexcept;
  bool spin(Deadline deadline) noexcept;
  void announce(layout::SleepState how) noexcept;
  void sleep(Deadline deadline) noexcept;
  bool tryScanAllLinks() noexcept;
  void dropPeers() noexcept;

  Backplane backplane_;
  OwnWindow window_;
  WaitMode mode_;
  std::vector<Link*> links_;
  std::vector<std::uint32_t> freeIndices_;
  std::array<Hot, kHotLinks> hot_{};
  std::size_t hotCount_ = 0;
  std::size_t cursor_ = 0;
  std::uint32_t sinceHints_ = 0;  // messages of polled links since the last look at the hints
  std::uint32_t sinceScan_ = 0;  // looks at the hints since the last scan of all links
  std::uint32_t readyCursor_ = 0;
  // A link that is not polled and may have further messages after the one that was taken.
  std::optional<std::uint32_t> revisit_;
  std::uint32_t knockedSeen_ = 0;
  std::uint32_t knockCursor_ = layout::kKnocks;
  std::atomic<std::uint32_t> localNews_{0};
  std::atomic<bool> peerDied_{false};
  bool armed_ = false;
  std::uint64_t sleepNumber_ = 0;  // number of the last sleep that was announced
  bool slept_ = false;
  std::int64_t wakeNs_ = 10'000;  // estimated duration of a wake-up
  // How often the spinning time is halved: once more after each long sleep, 0 after a short one.
  std::uint32_t spinShift_ = 0;
  std::int64_t scannedAllNs_ = 0;  // time of the last scan of all links

  struct Peer {
    std::weak_ptr<PeerWindow> window;
    Watcher::Token token;
  };
  // By name: the current window, and older windows of the name whose links have not ended yet.
  std::multimap<std::string, Peer> peers_;
};

}  // namespace mpf
