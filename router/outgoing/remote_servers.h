// SPDX-License-Identifier: MIT
// RemoteServers: the servers of one remote that clients of this host use or wait for.
//
//   pending binds ─► bind ─► the peer reports "there" ─► Proxy ... "absent" ─► drained, destroyed
//
// It outlives a connection: connect() binds the servers over a new connection,
// disconnect() destroys their proxies. A server that no client has used or waited for during
// kIdleProxyNs is unbound and forgotten.
//
// Threads  that of the event loop.
// Trust    any violation of the protocol is a ProtocolError.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>

#include "router/alarm.h"
#include "router/outgoing/proxy.h"
#include "router/outgoing/remote_connection.h"
#include "router/router_context.h"
#include "router/server_name.h"

namespace mpf::router {

class RemoteServers {
 public:
  // `context`, `remote` and `record` outlive this object.
  RemoteServers(RouterContext& context, const Remote& remote, PeerRecord& record, const Log& log);

  // Sets which servers the clients of this host wait for now, at any location.
  void setPendingBinds(const std::set<ServerName>& pendingBinds);
  // The peer of `line` has greeted. The line exists until after disconnect().
  void connect(Line& line);
  // The line has ended. Requests that were never written to it end as neverTaken. All others end at
  // the local clients when the proxies are destroyed, as with any server that exits.
  void disconnect(const std::string& why);
  // Resolves when the local clients have had the time to receive what the proxies have sent. Call
  // it once, when no connection follows.
  [[nodiscard]] kj::Promise<void> whenProxiesAreGone() { return ending_.onEmpty(); }

  // Handles an item of the peer. Items for a client that has disconnected are ignored.
  //   throws  ProtocolError
  void handle(wire::Item::Reader item);
  void handle(PlainItem& item);
  void handle(const PlainItems& items);
  // Takes requests of the local clients while the line has room.
  void pump();
  // A request cannot be sent, for the reason `why`.
  void refuse(const Carried& request, const std::string& why);

 private:
  struct Wanted {
    std::uint32_t binding = 0;  // 0: no bind has been sent
    std::unique_ptr<Proxy> proxy;
    // An offer for which there is no proxy yet, for example because its name is in use here.
    std::optional<Proxy::Offer> offer;
    std::string problem;  // last logged reason why there is no proxy
    std::int64_t bindAgainNs = 0;  // earliest time of the next bind, after a refusal
    std::int64_t idleSinceNs = 0;  // 0: clients use it or wait for it
  };
  void bindWanted();
  void bind(const ServerName& name, Wanted& wanted);
  void unbind(const Wanted& wanted);
  void onServer(wire::Server::Reader server);
  template <class Items>
  void handlePlain(Items& items);
  void onFate(wire::RequestEnd::Reader fate);
  void onRefusal(const ServerName& name, Wanted& wanted, const std::string& why);
  void makeProxy(const ServerName& name, Wanted& wanted);
  void endProxy(Wanted& wanted);
  void sweep();
  void sweepSoon();
  void updateProxy(const ServerName& name, Wanted& wanted);
  [[nodiscard]] bool isPending(const Wanted& wanted) const;

  RouterContext& context_;
  const Remote& remote_;
  PeerRecord& record_;
  Log log_;
  Alarm pumpAgain_;
  Alarm sweeps_;
  std::unique_ptr<RemoteConnection> connection_;  // nullptr: the remote is not connected
  std::map<ServerName, Wanted> wanted_;  // its proxies use connection_
  std::unordered_map<std::uint32_t, ServerName> bindings_;  // of the connection
  std::uint32_t lastBinding_ = 0;
  ServerName pumped_;  // the server whose requests were taken last
  FatalTasks ending_;  // they keep the pools of proxies that have ended
};

}  // namespace mpf::router
