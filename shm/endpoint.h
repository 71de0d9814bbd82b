// SPDX-License-Identifier: MIT
// Endpoint: a window with the links that end at it, and the wait for the next message of any of
// them.
//
//   busy links are polled directly ─► then ready bits ─► nothing: spin for a while ─► announce, look again, sleep
//
// A thousand idle links cost nothing: they are looked at when their ready bit is set. Links take
// turns, one message each.
//
// Threads  one owner thread; interrupt() may be called by any thread and by a signal handler.
// Crash    a peer's death comes through the watcher as local news.
// Trust    hints may be wrong in either way: who is about to sleep looks at every link.
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
  // As OwnWindow. `mode` is what wait() does.
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
  // A free bit for a new link; nullopt when all are taken.
  std::optional<std::uint32_t> tryReserve() noexcept;
  void attach(std::uint32_t index, Link& link);
  void detach(std::uint32_t index) noexcept;
  // What comes of a held link is no news until it is released.
  void hold(std::uint32_t index) noexcept;
  void release(std::uint32_t index, Link& link) noexcept;
  // A peer's window, mapped once and watched: its death comes as local news, with peer()->isDead()
  // on the links.
  std::shared_ptr<PeerWindow> peer(const std::string& name, layout::SegmentKind kind);

  // --- what is new ---
  // Index of a link that may have a message or a change of state; nullopt when there is none now.
  // Take one message of it.
  std::optional<std::uint32_t> next() noexcept;
  // Whether one of the next three may have something. Cheap: three loads.
  [[nodiscard]] bool hasSideNews() const noexcept {
    const auto& hints = window_.hints();
    return hints.knocked.load(std::memory_order_relaxed) != knockedSeen_ ||
           hints.rescan.load(std::memory_order_relaxed) != 0 ||
           localNews_.load(std::memory_order_relaxed) != 0 || knockCursor_ != layout::kKnocks;
  }
  // A link that wants to be accepted.
  std::optional<std::uint64_t> takeKnock() noexcept;
  // Knocks were lost: look for links by name.
  bool takeRescan() noexcept;
  // Something happened in this process: a peer died, a server appeared, interrupt() was called.
  bool takeLocalNews() noexcept;
  // After local news: a peer died, some links' peer()->isDead().
  bool takePeerDeath() noexcept { return peerDied_.exchange(false, std::memory_order_relaxed); }

  // Waits until one of the four above may have something. False when `deadline` passed first.
  bool wait(Deadline deadline) noexcept;
  // Ends the current or the next wait().
  void interrupt() noexcept;

  // For event loops: a descriptor that is readable when there is news. arm() it before each wait in
  // poll(); when it returns false there is news already.
  [[nodiscard]] int descriptor() const noexcept { return window_.fifo().get(); }
  bool arm() noexcept;
  void disarm() noexcept;
  // Leaves the descriptor readable: not all that is new was looked at.
  void callAgain() noexcept { window_.ring(); }

  // What a wake-up costs, as seen from a message that ended a sleep.
  void noteWake(std::int64_t ns) noexcept {
    wakeNs_ += (std::min<std::int64_t>(ns, 1'000'000) - wakeNs_) / 8;
  }
  // Whether the last wait() slept.
  [[nodiscard]] bool slept() const noexcept { return slept_; }

 private:
  struct Hot {
    std::uint32_t index;
    std::uint32_t misses;
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
  bool tryLookAtAll() noexcept;
  void dropPeers() noexcept;

  Backplane backplane_;
  OwnWindow window_;
  WaitMode mode_;
  std::vector<Link*> links_;
  std::vector<std::uint32_t> freeIndices_;
  std::array<Hot, kHotLinks> hot_{};
  std::size_t hotCount_ = 0;
  std::size_t cursor_ = 0;
  std::uint32_t sinceHints_ = 0;  // messages of polled links
  std::uint32_t sinceLook_ = 0;  // looks at the hints
  std::uint32_t readyCursor_ = 0;
  // a cold link that may have more than the one message taken
  std::optional<std::uint32_t> revisit_;
  std::uint32_t knockedSeen_ = 0;
  std::uint32_t knockCursor_ = layout::kKnocks;
  std::atomic<std::uint32_t> localNews_{0};
  std::atomic<bool> peerDied_{false};
  bool armed_ = false;
  std::uint64_t sleepNumber_ = 0;  // of the last sleep that was announced
  bool slept_ = false;
  std::int64_t wakeNs_ = 10'000;
  std::uint32_t spinShift_ = 0;  // spinning that did not pay is tried shorter
  std::int64_t lookedAtAllNs_ = 0;

  struct Peer {
    std::weak_ptr<PeerWindow> window;
    Watcher::Token token;
  };
  // of one name: a new window, and those before it whose links have not ended yet
  std::multimap<std::string, Peer> peers_;
};

}  // namespace mpf
