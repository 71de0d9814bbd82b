// SPDX-License-Identifier: MIT
// Presence: whether a server of this backplane is there, and what it offers. It takes part in
// nothing: no link, no message.
//
// Threads  that of the event loop; `news` is called by the watcher's thread, too.
// Trust    what a server's window says is bounded before use.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include <mpf/backplane.h>

#include "router/outgoing/pending_binds.h"
#include "shm/watcher.h"

namespace mpf::router {

class Presence {
 public:
  // `news` when the process of the server that look() found is gone; of one that ended in a process
  // that lives on, isDoubtful() tells. Also when look() itself finds another answer than
  // isDoubtful() would have told of: for those who share this, and did not look.
  Presence(Backplane backplane, ServerName name, std::function<void()> news);
  ~Presence();
  Presence(const Presence&) = delete;
  Presence& operator=(const Presence&) = delete;

  // Asks the kernel. True: it is there, and the following speak of it.
  bool look();

  // look() may find another answer now, though nobody told.
  [[nodiscard]] bool isDoubtful() const noexcept { return window_ ? window_->isClosed() : failed_; }

  [[nodiscard]] std::uint64_t incarnation() const noexcept {
    return window_ ? window_->header().incarnation : 0;
  }
  [[nodiscard]] std::uint32_t queueSize() const noexcept;
  [[nodiscard]] std::uint64_t maxMessageBytes() const noexcept {
    return window_->header().maxMessageBytes;
  }
  // Why it is not there.
  [[nodiscard]] const std::string& problem() const noexcept { return problem_; }

 private:
  bool find();
  void forget() noexcept;
  Backplane backplane_;
  ServerName name_;
  std::function<void()> news_;
  std::shared_ptr<PeerWindow> window_;
  Watcher::Token token_ = 0;
  std::string problem_;
  bool failed_ = false;  // to look: no descriptor was left, say
};

}  // namespace mpf::router
