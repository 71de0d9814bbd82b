// SPDX-License-Identifier: MIT
#include "router/incoming/server_monitor.h"

#include <algorithm>
#include <fmt/format.h>
#include <stdexcept>

#include "shm/link.h"
#include "shm/segment_name.h"

namespace mpf::router {

ServerMonitor::ServerMonitor(Backplane backplane, ServerName name, std::function<void()> onChange)
    : backplane_(std::move(backplane)), name_(std::move(name)), onChange_(std::move(onChange)) {}

ServerMonitor::~ServerMonitor() { forget(); }

void ServerMonitor::forget() noexcept {
  if (window_) backplane_.watcher().forget(token_);
  window_.reset();
}

bool ServerMonitor::look() {
  const auto before = incarnation();
  const bool hadFailed = failed_;
  const bool isThere = find();
  if ((before != 0 || hadFailed) && incarnation() != before) onChange_();
  return isThere;
}

bool ServerMonitor::find() try {
  if (window_ && !window_->isDead() && !window_->isClosed() && !window_->isLost() &&
      window_->hasOwner())
    return true;
  forget();
  failed_ = false;
  problem_ = "the server is not running";
  auto window = PeerWindow::tryOpen(
      SegmentName::serverWindow(backplane_.name(), name_.location, name_.server),
      layout::SegmentKind::serverWindow);
  if (!window || window->isClosed() || !window->hasOwner()) return false;
  if (window->header().hops >= kMaxHops)
    throw std::runtime_error(
        fmt::format("{} connections between routers lead to it: connect the hosts directly, or, if "
                    "the locations of routers form a cycle, change them",
                    window->header().hops));
  token_ = backplane_.watcher().watchPeer(window, onChange_);
  window_ = std::move(window);
  problem_.clear();
  return true;
} catch (const std::exception& error) {
  failed_ = true;
  problem_ = error.what();
  return false;
}

std::uint32_t ServerMonitor::queueSize() const noexcept {
  return std::clamp(window_->control().queueSize.load(std::memory_order_relaxed), 1u,
                    LinkGeometry::kMaxQueueSize);
}

}  // namespace mpf::router
