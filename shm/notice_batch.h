// SPDX-License-Identifier: MIT
// NoticeBatch: delays the notices of its thread. Consecutive messages on one link cause one notice,
// after the last of them, or before, if there are many. Otherwise the first notice would wake a
// receiver on the same processor, which would compete with the sender for the rest of the run.
//
// Threads  used by the thread that made it, which has no other batch at that time.
#pragma once

#include <cassert>
#include <cstdint>
#include <memory>
#include <utility>

#include "shm/window.h"

namespace mpf {

class NoticeBatch {
 public:
  NoticeBatch() noexcept {
    assert(current_ == nullptr);
    current_ = this;
  }
  ~NoticeBatch() {
    give();
    current_ = nullptr;
  }
  NoticeBatch(const NoticeBatch&) = delete;
  NoticeBatch& operator=(const NoticeBatch&) = delete;

  // Gives the notice that is delayed, if there is one.
  void give() noexcept {
    delayed_ = 0;
    if (const auto peer = std::exchange(peer_, nullptr)) peer->notify(link_);
  }
  // Notifies the owner of `peer` of messages on link `link`. If this thread has a batch, it delays
  // the notice until at least `most` messages have been sent since the last one.
  //   messages  sent since the last call for this link
  static void notify(const std::shared_ptr<PeerWindow>& peer, std::uint32_t link,
                     std::uint64_t messages, std::uint32_t most) noexcept {
    if (current_ == nullptr) peer->notify(link);
    else current_->delay(peer, link, messages, most);
  }

 private:
  void delay(const std::shared_ptr<PeerWindow>& peer, std::uint32_t link, std::uint64_t messages,
             std::uint32_t most) noexcept {
    if (peer_ != peer || link_ != link) {
      give();
      peer_ = peer;
      link_ = link;
    }
    delayed_ += messages;
    if (delayed_ >= most) give();
  }

  // NOLINTNEXTLINE(readability-identifier-naming): a private member, static or not, ends in `_`
  static inline constinit thread_local NoticeBatch* current_ = nullptr;
  std::shared_ptr<PeerWindow> peer_;  // nullptr: no notice is delayed
  std::uint32_t link_ = 0;
  std::uint64_t delayed_ = 0;  // messages since the last notice
};

}  // namespace mpf
