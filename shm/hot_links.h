// SPDX-License-Identifier: MIT
// HotLinks: the busy links of an endpoint, which it polls. Their peers need not set ready bits.
//
//   ready bit ─► tryAdd ─► polled ─► kCoolAfter polls without a message, or remove() ─► ready bit
//
// Threads  one owner thread.
// Trust    as Link: a peer that writes invalid data affects only its own link.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "shm/link.h"
#include "shm/ready_bits.h"

namespace mpf {

class HotLinks {
 public:
  static constexpr std::size_t kCapacity = 8;
  // polls without a message before polling of a link ends
  static constexpr std::uint32_t kCoolAfter = 4096;
  // polls without a message before a busier link may replace a polled one
  static constexpr std::uint32_t kReplaceAfter = 64;

  // Polls with a message before the peer may send without a fence. The end of polling then costs a
  // barrier in all processes (15 us), so a link that sleeps after each message never reaches it.
  static constexpr std::uint32_t kUnfencedAfter = 1024;

  //   pollsInWaits   whether the owner polls while it waits; otherwise it sleeps at once
  HotLinks(ReadyBits& readyBits, bool pollsInWaits) noexcept
      : readyBits_(readyBits), pollsInWaits_(pollsInWaits) {}
  HotLinks(const HotLinks&) = delete;
  HotLinks& operator=(const HotLinks&) = delete;

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  // Polls a link from now on, in place of idle ones if necessary. Returns false, and the link is
  // not polled, if there are kCapacity busier links.
  bool tryAdd(std::uint32_t index, Link& link) noexcept;
  // Stops polling a link, if it is polled. Its ready bit is set if it has an event.
  void remove(std::uint32_t index) noexcept;
  void removeAll() noexcept;

  [[nodiscard]] bool hasMessage() const noexcept {
    for (std::size_t place = 0; place < size_; ++place) {
      if (hot_[place].link->incoming().hasMessage()) return true;
    }
    return false;
  }
  // The next polled link that has a message; links take turns. Requests the line of the next slot
  // of the other direction. nullptr if it finds none.
  // Frees the slots of a link when it finds no message there for the first time. Ends the polling
  // of a link that is idle for long, and then returns although others may have messages.
  [[gnu::always_inline]] Link* next() noexcept {
    for (auto looks = size_; looks != 0; --looks) {
      if (++turn_ >= hot_.data() + size_) turn_ = hot_.data();
      auto& hot = *turn_;
      if (hot.link->incoming().hasMessage()) {
        hot.misses = 0;
        hot.link->outgoing().expectPush();
        if (++hot.turns == kUnfencedAfter) hot.link->letPeerSendUnfenced();
        return hot.link;
      }
      if (++hot.misses == 1) hot.link->incoming().onEmpty();
      if (hot.misses >= kCoolAfter) return cool(static_cast<std::size_t>(turn_ - hot_.data()));
    }
    return nullptr;
  }

 private:
  struct Hot {
    std::uint32_t index;
    std::uint32_t misses;  // consecutive polls without a message
    std::uint32_t turns;  // polls with a message
    Link* link;
  };
  // Stops polling the link at `place`; returns it if a message has arrived.
  Link* cool(std::size_t place) noexcept;
  // Sets the ready bit if the link has an event; otherwise frees the slots of the messages taken.
  void noteEvents(const Hot& cooled) noexcept;

  ReadyBits& readyBits_;
  const bool pollsInWaits_;
  std::array<Hot, kCapacity> hot_{};
  std::size_t size_ = 0;
  Hot* turn_ = hot_.data();  // the link that had its turn last
};

}  // namespace mpf
