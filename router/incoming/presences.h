// SPDX-License-Identifier: MIT
// Presences: one Presence for each server of this host that somebody elsewhere has bound to,
// whoever that is and how often. Each takes descriptors and memory, and a peer may bind as often as
// it likes.
//
// Threads  that of the event loop.
#pragma once

#include <functional>
#include <map>
#include <memory>

#include "router/incoming/presence.h"
#include "router/readable.h"
#include "shm/watcher.h"

namespace mpf::router {

class Presences {
 public:
  // `news` when a server may have come or gone: all who have bound look again, as another's look
  // may have been the one that found it.
  Presences(const Backplane& backplane, kj::UnixEventPort& port, std::function<void()> news);
  ~Presences() noexcept;
  Presences(const Presences&) = delete;
  Presences& operator=(const Presences&) = delete;

  // It goes with the last one who has it, who goes before this.
  [[nodiscard]] std::shared_ptr<Presence> of(const ServerName& name);

 private:
  struct Shared {
    Shared(const Backplane& backplane, const ServerName& name, std::function<void()> news)
        : presence(backplane, name, std::move(news)) {}
    Presence presence;
    std::weak_ptr<Presence> users;
  };
  Backplane backplane_;
  Bell bell_;
  Watcher::Token names_ = 0;
  std::map<ServerName, Shared> all_;
};

}  // namespace mpf::router
