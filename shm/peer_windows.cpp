// SPDX-License-Identifier: MIT
#include "shm/peer_windows.h"

#include <exception>
#include <utility>

#include "shm/stale_segments.h"

namespace mpf {

PeerWindows::PeerWindows(Backplane backplane, std::function<void()> onDeath)
    : backplane_(std::move(backplane)), onDeath_(std::move(onDeath)) {}

PeerWindows::~PeerWindows() {
  if (forkGuard_.isInherited()) return;
  for (const auto& [name, peer] : peers_) backplane_.watcher().forget(peer.token);
}

std::shared_ptr<PeerWindow> PeerWindows::tryOpen(const std::string& name,
                                                 layout::SegmentKind kind) {
  const auto [first, last] = peers_.equal_range(name);
  for (auto peer = first; peer != last; ++peer) {
    auto window = peer->second.window.lock();
    // Links may still use a window that is closed or lost. It stays watched, because its owner may
    // die before it has closed these links.
    if (window && !window->isDead() && !window->isClosed() && !window->isLost()) return window;
  }
  auto window = PeerWindow::tryOpen(name, kind);
  if (!window || window->isClosed() || !window->isLocked()) return nullptr;
  const auto clean = [this, name, incarnation = window->header().incarnation] {
    try {
      stale_segments::removeDeadWindow(backplane_.name(), name, incarnation);
      // NOLINTNEXTLINE(bugprone-empty-catch): no memory: others remove the files
    } catch (const std::exception&) {
    }
    onDeath_();
  };
  auto& peer = peers_.emplace(name, Peer{window})->second;
  hasNew_ = true;
  peer.token = backplane_.watcher().addPeer(window, clean);
  return window;
}

void PeerWindows::settleAll() noexcept {
  dropUnused(peers_.begin(), peers_.end());
  for (auto& [name, peer] : peers_) {
    if (!std::exchange(peer.isWatchedClosely, true)) backplane_.watcher().watchProcess(peer.token);
  }
}

void PeerWindows::release(std::shared_ptr<PeerWindow> window) noexcept {
  // Nobody watches a dead peer. After many deaths at once, forget() would wait for the watcher's
  // thread, which reports them.
  if (window->isDead()) return;
  const auto [first, last] = peers_.equal_range(window->name());
  window.reset();
  dropUnused(first, last);
}

void PeerWindows::dropUnused(Peers::iterator from, Peers::iterator to) noexcept {
  for (auto peer = from; peer != to;) {
    if (peer->second.window.use_count() > 1) {  // the watcher holds one reference
      ++peer;
      continue;
    }
    backplane_.watcher().forget(peer->second.token);
    peer = peers_.erase(peer);
  }
}

}  // namespace mpf
