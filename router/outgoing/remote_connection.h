// SPDX-License-Identifier: MIT
// RemoteConnection: one connection to a remote router that has greeted, and the numbers of the
// local clients that use it.
//
// Threads  that of the event loop.
// Trust    an item for a client that was never opened is a ProtocolError.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include "router/statistics.h"
#include "router/transport/line.h"
#include "server/programs/log.h"

namespace mpf::router {

class Proxy;  // NOLINT(cppcoreguidelines-virtual-class-destructor): it is final

class RemoteConnection {
 public:
  // `line` and `record` outlive this object.
  //   address   of the remote, for the log
  //   onRemove  called when a client has been removed
  RemoteConnection(Line& line, PeerRecord& record, const Log& log, std::string address,
                   std::function<void()> onRemove);

  [[nodiscard]] Line& line() noexcept { return line_; }
  [[nodiscard]] PeerRecord& record() noexcept { return record_; }
  [[nodiscard]] const Log& log() const noexcept { return log_; }

  // Returns the number of a new client of `proxy`; nullopt: the peer accepts no more clients.
  [[nodiscard]] std::optional<std::uint32_t> tryAddClient(Proxy& proxy);
  void removeClient(std::uint32_t number);
  // The proxy of a client; nullptr: the client has disconnected.
  [[nodiscard]] Proxy* proxyOf(std::uint32_t client) const;
  // As proxyOf(), for a number that the peer has sent.
  //   throws  ProtocolError: the client was never opened
  [[nodiscard]] Proxy* openedProxyOf(std::uint32_t client) const;

 private:
  void countClients() noexcept;

  Line& line_;
  PeerRecord& record_;
  Log log_;
  std::string address_;
  std::function<void()> onRemove_;
  std::unordered_map<std::uint32_t, Proxy*> clients_;
  // The client of the last item, so that a run of them costs one look-up.
  mutable std::pair<std::uint32_t, Proxy*> recent_{};
  std::uint32_t lastClient_ = 0;
  bool maxClientsLogged_ = false;
};

}  // namespace mpf::router
