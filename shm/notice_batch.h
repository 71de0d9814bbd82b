// SPDX-License-Identifier: MIT
// NoticeBatch: while it exists, the thread that made it notifies the receiver of a run of messages
// once, at the end of the run, instead of at the first message. A receiver that sleeps on the same
// processor would otherwise interrupt the sender for each of the first messages.
//
// Threads  the one that made it. A thread has one at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <utility>

#include "shm/window.h"

namespace mpf {

class NoticeBatch {
 public:
  NoticeBatch() noexcept { current_ = this; }
  ~NoticeBatch() {
    give();
    current_ = nullptr;
  }
  NoticeBatch(const NoticeBatch&) = delete;
  NoticeBatch& operator=(const NoticeBatch&) = delete;

  // Ends the run: gives the notice that is held.
  void give() noexcept {
    if (const auto peer = std::exchange(peer_, nullptr)) peer->notify(link_);
  }
  // Notifies the owner of `peer` of link `link`, or holds the notice if this thread has a batch.
  static void notify(const std::shared_ptr<PeerWindow>& peer, std::uint32_t link) noexcept {
    if (current_ == nullptr) peer->notify(link);
    else current_->hold(peer, link);
  }

 private:
  void hold(const std::shared_ptr<PeerWindow>& peer, std::uint32_t link) noexcept {
    if (peer_ == peer && link_ == link) return;
    give();
    peer_ = peer;
    link_ = link;
  }

  static inline constinit thread_local NoticeBatch* current_ = nullptr;
  std::shared_ptr<PeerWindow> peer_;  // nullptr: no notice is held
  std::uint32_t link_ = 0;
};

}  // namespace mpf
