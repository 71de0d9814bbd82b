// SPDX-License-Identifier: MIT
// ServerMonitors: one ServerMonitor for each server of this host that clients of other hosts have
// bound to. All bindings to a server share it, because each ServerMonitor needs descriptors and
// memory, and peers may open many bindings.
//
// Threads  that of the event loop.
#pragma once

#include <functional>
#include <map>
#include <memory>

#include "router/incoming/server_monitor.h"
#include "router/readable.h"
#include "shm/watcher.h"

namespace mpf::router {

class ServerMonitors {
 public:
  // Calls `onChange`, in the event loop, when a server may have started or ended. Then call
  // lookAtAll(), and let every binding read its ServerMonitor again.
  ServerMonitors(const Backplane& backplane, kj::UnixEventPort& port,
                 std::function<void()> onChange);
  ~ServerMonitors() noexcept;
  ServerMonitors(const ServerMonitors&) = delete;
  ServerMonitors& operator=(const ServerMonitors&) = delete;

  // The ServerMonitor is destroyed with its last reference, which must not outlive this object.
  [[nodiscard]] std::shared_ptr<ServerMonitor> of(const ServerName& name);
  // Calls look() of each, once for all of its users, because it asks the kernel.
  void lookAtAll();

 private:
  struct Shared {
    Shared(const Backplane& backplane, const ServerName& name, std::function<void()> onChange)
        : monitor(backplane, name, std::move(onChange)) {}
    ServerMonitor monitor;
    std::weak_ptr<ServerMonitor> users;
  };
  Backplane backplane_;
  Bell bell_;
  Watcher::Token names_ = 0;
  std::map<ServerName, Shared> all_;
};

}  // namespace mpf::router
