// SPDX-License-Identifier: MIT
// LocalServers: the servers of this host that the clients of one accepted connection use.
//
//   bind ─► ServerMonitor, shared by all connections ─► "there" / "absent"
//   open ─► FarClient ─► server
//
// States of a binding:
//   absent ─ the server is running ─► there ─ it has ended ─► ending ─ all its clients have been
//     ▲                                                          │     disconnected
//     └──────────────────────────────────────────────────────────┘
//
// Threads  that of the event loop.
// Crash    when it is destroyed, the clients disconnect from the servers. Requests that were on
//          their way to the servers are not sent again.
// Trust    a peer can bind only to servers that it is allowed to use. Any violation of the protocol
//          is a ProtocolError.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "router/alarm.h"
#include "router/incoming/far_clients.h"
#include "router/incoming/server_monitors.h"
#include "router/router_context.h"
#include "router/transport/line.h"

namespace mpf::router {

class LocalServers {
 public:
  // `context`, `line` and `record` outlive this object.
  //   peer     the common name of the peer's certificate; empty: plain TCP
  //   address  of the peer, for the log
  LocalServers(RouterContext& context, Line& line, PeerRecord& record, std::string peer,
               std::string address);

  // Handles an item of the peer.
  //   throws  ProtocolError
  void handle(wire::Item::Reader item);
  void handle(PlainItem& item);
  void handle(const PlainItems& items);
  // Receives messages of the servers while the line has room.
  void run() { clients_.run(); }
  void onTraffic() { clients_.onTraffic(); }
  // A reply cannot be sent, for the reason `why`; the server has handled its request. Fills in what
  // is sent instead.
  void loseReply(const Carried& reply, const std::string& why, wire::Item::Builder instead);

  // Servers may have started or ended: ServerMonitors has looked at all.
  void onServers();
  // The served locations or the rules in [[allow]] have changed.
  void onConfig();

 private:
  struct Binding {
    enum class State { absent, there, ending };
    std::uint32_t number;
    ServerName name;  // with the location that the peer uses
    std::int32_t local;  // the location on this host
    // Shared: it may already describe a later incarnation than `announced`.
    std::shared_ptr<ServerMonitor> monitor;
    State state = State::absent;
    std::uint64_t announced = 0;  // incarnation announced to the peer; 0: absent
    std::uint32_t queueSize = 0;  // as announced to the peer
    std::size_t connected = 0;  // clients that have connected and have not been disconnected
    bool failureLogged = false;  // that `monitor` cannot look at the server
  };
  void onBind(wire::Bind::Reader bind);
  void onUnbind(std::uint32_t number);
  void onOpen(wire::Open::Reader open);
  void onRequest(wire::Request::Reader request);
  void endWithoutClient(std::uint32_t client, std::uint32_t requestId);
  void onClose(std::uint32_t number);
  void refuseBind(std::uint32_t number, const std::string& why);
  void refuseClient(std::uint32_t number, const std::string& why);
  void look(Binding& binding);
  void update(Binding& binding);
  void lookAtDoubtful();
  void lookSoon();
  void logFailure(Binding& binding, bool hasFailed);
  void beginEnd(Binding& binding);
  void endIfDone(Binding& binding);
  void sendThere(Binding& binding);
  void sendAbsent(const Binding& binding);
  void countBindings() noexcept;
  Binding* bindingOf(const FarClient& client);
  void onConnected(FarClient& client);
  void onDisconnected(FarClient& client);

  RouterContext& context_;
  Line& line_;
  PeerRecord& record_;
  std::string peer_;
  std::string address_;
  std::map<std::uint32_t, Binding> bindings_;
  FarClients clients_;
  Alarm looks_;
};

}  // namespace mpf::router
