// SPDX-License-Identifier: MIT
#include "router/incoming/presences.h"

namespace mpf::router {

Presences::Presences(const Backplane& backplane, kj::UnixEventPort& port,
                     std::function<void()> onChange)
    : backplane_(backplane), bell_(port, std::move(onChange)) {
  names_ = backplane_.watcher().watchNames(NameKind::serverWindow, [this] { bell_.ring(); });
}

Presences::~Presences() noexcept { backplane_.watcher().forget(names_); }

std::shared_ptr<Presence> Presences::of(const ServerName& name) {
  const auto each = all_.try_emplace(name, backplane_, name, [this] { bell_.ring(); }).first;
  if (auto users = each->second.users.lock()) return users;
  std::shared_ptr<Presence> first(&each->second.presence,
                                  [this, each](Presence*) { all_.erase(each); });
  each->second.users = first;
  return first;
}

}  // namespace mpf::router
