// SPDX-License-Identifier: MIT
#include "router/incoming/server_monitors.h"

namespace mpf::router {

ServerMonitors::ServerMonitors(const Backplane& backplane, kj::UnixEventPort& port,
                               std::function<void()> onChange)
    : backplane_(backplane), bell_(port, std::move(onChange)) {
  names_ = backplane_.watcher().watchNames(NameKind::serverWindow, [this] { bell_.ring(); });
}

ServerMonitors::~ServerMonitors() noexcept { backplane_.watcher().forget(names_); }

std::shared_ptr<ServerMonitor> ServerMonitors::of(const ServerName& name) {
  const auto each = all_.try_emplace(name, backplane_, name, [this] { bell_.ring(); }).first;
  if (auto users = each->second.users.lock()) return users;
  std::shared_ptr<ServerMonitor> first(&each->second.monitor,
                                       [this, each](ServerMonitor*) { all_.erase(each); });
  each->second.users = first;
  return first;
}

void ServerMonitors::lookAtAll() {
  for (auto& [name, each] : all_) each.monitor.look();
}

}  // namespace mpf::router
