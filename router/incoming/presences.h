// SPDX-License-Identifier: MIT
// Presences: one Presence for each server of this host that clients of other hosts have bound to.
// All bindings to a server share it, because each Presence needs descriptors and memory, and peers
// may open many bindings.
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
  // Calls `onChange` when a server may have started or ended. All bindings must then call look()
  // again, because the look() of one binding consumes the change for all.
  Presences(const Backplane& backplane, kj::UnixEventPort& port, std::function<void()> onChange);
  ~Presences() noexcept;
  Presences(const Presences&) = delete;
  Presences& operator=(const Presences&) = delete;

  // The Presence is destroyed with its last reference, which must not outlive this object.
  [[nodiscard]] std::shared_ptr<Presence> of(const ServerName& name);

 private:
  struct Shared {
    Shared(const Backplane& backplane, const ServerName& name, std::function<void()> onChange)
        : presence(backplane, name, std::move(onChange)) {}
    Presence presence;
    std::weak_ptr<Presence> users;
  };
  Backplane backplane_;
  Bell bell_;
  Watcher::Token names_ = 0;
  std::map<ServerName, Shared> all_;
};

}  // namespace mpf::router
