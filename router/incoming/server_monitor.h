// SPDX-License-Identifier: MIT
// ServerMonitor: observes whether a server of this backplane is running, and what it offers,
// without connecting to it.
//
// Threads  that of the event loop; `onChange` is also called by the watcher's thread.
// Trust    values that are read from a server's window are bounded before use.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include <mpf/backplane.h>

#include "router/server_name.h"
#include "shm/watcher.h"

namespace mpf::router {

class ServerMonitor {
 public:
  // Calls `onChange` in two cases:
  // - The process of the server that look() found exits.
  // - look() finds a change: a known server has ended or was replaced, or a server is running after
  //   a look() that failed. The other users of this object must then be told.
  // `onChange` is not called when the server ends but its process continues; isDoubtful() is then
  // true.
  ServerMonitor(Backplane backplane, ServerName name, std::function<void()> onChange);
  ~ServerMonitor();
  ServerMonitor(const ServerMonitor&) = delete;
  ServerMonitor& operator=(const ServerMonitor&) = delete;

  // Asks the kernel whether the server is running. If true, the accessors below describe it.
  bool look();
  // What the last look() has returned.
  [[nodiscard]] bool isThere() const noexcept { return window_ != nullptr; }

  // Whether the next look() may have another result although `onChange` was not called.
  [[nodiscard]] bool isDoubtful() const noexcept { return window_ ? window_->isClosed() : failed_; }

  [[nodiscard]] std::uint64_t incarnation() const noexcept {
    return window_ ? window_->header().incarnation : 0;
  }
  [[nodiscard]] std::uint32_t queueSize() const noexcept;
  [[nodiscard]] std::uint64_t maxMessageBytes() const noexcept {
    return window_->header().maxMessageBytes;
  }
  [[nodiscard]] std::uint32_t hops() const noexcept { return window_->header().hops; }
  // Why the last look() found no server.
  [[nodiscard]] const std::string& problem() const noexcept { return problem_; }

 private:
  bool find();
  void forget() noexcept;
  Backplane backplane_;
  ServerName name_;
  std::function<void()> onChange_;
  std::shared_ptr<PeerWindow> window_;
  Watcher::Token token_ = 0;
  std::string problem_;
  bool failed_ = false;  // the last look() failed, for example because no descriptor was left
};

}  // namespace mpf::router
