// SPDX-License-Identifier: MIT
// ServerRouter: one accepted connection from the client router of another host, and the servers of
// this host that its clients use ("RMRServer" in the manual's report).
//
//   bind ─► ServerMonitor, shared by all connections ─► "there" / "absent"
//   open ─► FarClient ─► server
//
// Each connection has its own dispatcher, which does not run while the line has no room. The queues
// of its clients then fill up, and other connections are not affected.
//
// Threads  that of the event loop.
// Crash    when the line ends, its clients disconnect from the servers. Requests that were on their
//          way to the servers are not sent again.
// Trust    a peer can bind only to servers that it is allowed to use, and can open at most
//          Limits::maxClients clients. Any violation of the protocol is a ProtocolError.
#pragma once

#include <map>
#include <memory>
#include <unordered_map>
#include <vector>

#include "router/incoming/far_client.h"
#include "router/incoming/server_monitors.h"
#include "router/readable.h"

namespace mpf::router {

class ServerRouter final : public Line::Owner, public FarClient::Owner {
 public:
  //   peer     the common name of the peer's certificate; empty: plain TCP
  //   address  the address from which the peer has connected
  ServerRouter(RouterContext& context, kj::Own<kj::AsyncIoStream> stream, std::string peer,
               const std::string& address, bool isTls);

  // Resolves when the line has ended.
  [[nodiscard]] kj::Promise<void> run();
  void stop();
  [[nodiscard]] bool hasGreeted() const noexcept { return line_->hasGreeted(); }
  // The served locations or the rules in [[allow]] have changed.
  void onConfig();
  // Servers may have started or ended.
  void lookAtAll();

 private:
  struct Binding {
    Binding(const ServerName& asCalled, ServerMonitors& monitors, std::int32_t where)
        : name(asCalled), local(where), monitor(monitors.of({local, asCalled.server})) {}
    ServerName name;  // with the location that the peer uses
    std::int32_t local;  // the location on this host
    // Shared: it may already describe a later incarnation than `announced`.
    std::shared_ptr<ServerMonitor> monitor;
    std::uint32_t queueSize = 0;  // as announced to the peer
    std::uint64_t announced = 0;  // incarnation announced to the peer; 0: absent
    bool isEnding = false;  // that server is gone, and some clients are still connected to it
    std::size_t connected = 0;  // clients that have connected and have not been disconnected
    bool failureLogged = false;  // that `monitor` cannot look at the server
  };
  void onBind(wire::Bind::Reader bind);
  void onUnbind(std::uint32_t number);
  void onOpen(wire::Open::Reader open);
  void addClient(wire::Open::Reader open, Binding& binding);
  void onClose(std::uint32_t client);
  void refuse(std::uint32_t number, const std::string& why);
  [[nodiscard]] const Serve* served(const ServerName& name) const;
  void look(std::uint32_t number, Binding& binding);
  void lookAtDoubtful();
  void lookSoon();
  void endIfDone(std::uint32_t number, Binding& binding);
  void sendThere(std::uint32_t number, Binding& binding);
  void sendAbsent(std::uint32_t number, Binding& binding);
  void countAll();
  void noteLocations();
  void runDispatcher();
  void scheduleTimer();

  // Line::Owner
  void onGreeting(const PeerGreeting& greeting) override;
  void onItem(wire::Item::Reader item) override;
  void onRoom() override;
  void onUnsendable(const Carried& carried, const std::string& why,
                    wire::Item::Builder instead) override;
  // FarClient::Owner
  Line& line() override { return *line_; }
  PeerRecord& record() override { return *record_; }
  std::size_t& heldBytes() override { return heldBytes_; }
  void refuseClient(std::uint32_t number, const std::string& why) override;
  void onConnected(FarClient& client) override;
  void onDisconnected(FarClient& client) override;

  RouterContext& context_;
  std::string peer_;
  std::string address_;
  std::shared_ptr<PeerRecord> record_;
  std::unique_ptr<Line> line_;
  std::unique_ptr<Dispatcher> dispatcher_;  // created with the first client
  std::unique_ptr<Readable> readable_;
  std::map<std::uint32_t, Binding> bindings_;
  std::size_t heldBytes_ = 0;  // of the requests that all clients hold
  std::unordered_map<std::uint32_t, std::unique_ptr<FarClient>> clients_;
  std::uint32_t lastClient_ = 0;
  std::vector<std::unique_ptr<FarClient>> dropped_;  // destroyed after the callback has returned
  Alarm timer_;
  Alarm looks_;
};

}  // namespace mpf::router
