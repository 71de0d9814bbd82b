// SPDX-License-Identifier: MIT
#include "router/outgoing/remote_connection.h"

#include <fmt/format.h>
#include <utility>

#include "router/protocol_error.h"

namespace mpf::router {

RemoteConnection::RemoteConnection(Line& line, PeerRecord& record, const Log& log,
                                   std::string address, std::function<void()> onRemove)
    : line_(line),
      record_(record),
      log_(log),
      address_(std::move(address)),
      onRemove_(std::move(onRemove)) {}

std::optional<std::uint32_t> RemoteConnection::tryAddClient(Proxy& proxy) {
  const auto most = line_.peer().maxClients;
  if (most != 0 && clients_.size() >= most) {
    if (!std::exchange(maxClientsLogged_, true))
      log_.warn(
          "{} accepts at most {} clients per connection (its max-clients): further clients are "
          "refused",
          address_, most);
    return std::nullopt;
  }
  if (lastClient_ == UINT32_MAX) {
    line_.end(FarewellCode::STOPPING, "all client numbers have been used");
    return std::nullopt;
  }
  clients_[++lastClient_] = &proxy;
  countClients();
  return lastClient_;
}

void RemoteConnection::removeClient(std::uint32_t number) {
  clients_.erase(number);
  recent_ = {};
  countClients();
  onRemove_();
}

void RemoteConnection::countClients() noexcept {
  record_->clients.store(clients_.size(), std::memory_order_relaxed);
}

Proxy* RemoteConnection::proxyOf(std::uint32_t client) const {
  if (recent_.second != nullptr && recent_.first == client) return recent_.second;
  const auto found = clients_.find(client);
  if (found == clients_.end()) return nullptr;
  recent_ = *found;
  return found->second;
}

Proxy* RemoteConnection::openedProxyOf(std::uint32_t client) const {
  if (client == 0 || client > lastClient_)
    throw ProtocolError(FarewellCode::PROTOCOL, fmt::format("client {} was never opened", client));
  return proxyOf(client);
}

}  // namespace mpf::router
