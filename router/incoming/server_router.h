// SPDX-License-Identifier: MIT
// ServerRouter: one accepted connection: a client router elsewhere, and the servers of this host
// that its clients use ("RMRServer" in the manual's report).
//
//   bind ─► Presence, which all share ─► "there" / "absent"          open ─► FarClient ─► server
//
// Each connection has a dispatcher of its own, which stands still while the line has no room: then
// the servers are told that their replies are not taken, and nobody else notices.
//
// Threads  that of the event loop.
// Crash    when the line ends, its clients are gone, as the servers see it; requests on their way
//          to them are not sent again.
// Trust    a peer sees what it is allowed to, opens so many clients and no more; nonsense is a
//          ProtocolError.
#pragma once

#include <map>
#include <memory>
#include <unordered_map>
#include <vector>

#include "router/incoming/far_client.h"
#include "router/incoming/presences.h"
#include "router/readable.h"

namespace mpf::router {

class ServerRouter final : public Line::Owner, public FarClient::Owner {
 public:
  //   peer     the common name of its certificate; empty: plain TCP
  //   address  where it called from
  ServerRouter(Surroundings& here, kj::Own<kj::AsyncIoStream> stream, std::string peer,
               const std::string& address, bool isTls);

  // Until the line has ended.
  [[nodiscard]] kj::Promise<void> run();
  void stop();
  [[nodiscard]] bool hasGreeted() const noexcept { return line_->hasGreeted(); }
  // What is served or allowed has changed.
  void onConfig();
  // Servers may have come or gone.
  void lookAtAll();

 private:
  struct Binding {
    Binding(const ServerName& asCalled, Presences& presences, std::int32_t where)
        : name(asCalled), local(where), presence(presences.of({local, asCalled.server})) {}
    ServerName name;  // as the peer calls it
    std::int32_t local;  // its location here
    std::shared_ptr<Presence> presence;  // it may know of another life than we
    std::uint32_t queueSize = 0;  // that the peer was told of
    std::uint64_t told = 0;  // incarnation that the peer was told of; 0: absent
    bool isEnding = false;  // that one is gone, and some clients have not heard of it yet
    std::size_t connected = 0;  // clients that have yet to hear of its end
    bool failureSaid = false;  // that we cannot look at it
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
  void tellThere(std::uint32_t number, Binding& binding);
  void tellAbsent(std::uint32_t number, Binding& binding);
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

  Surroundings& here_;
  std::string peer_;
  std::string address_;
  std::shared_ptr<PeerRecord> record_;
  std::unique_ptr<Line> line_;
  std::unique_ptr<Dispatcher> dispatcher_;  // from the first client on
  std::unique_ptr<Readable> readable_;
  std::map<std::uint32_t, Binding> bindings_;
  std::size_t heldBytes_ = 0;  // by clients
  std::unordered_map<std::uint32_t, std::unique_ptr<FarClient>> clients_;
  std::uint32_t lastClient_ = 0;
  std::vector<std::unique_ptr<FarClient>> dropped_;  // after the callback that dropped them
  Alarm timer_;
  Alarm looks_;
};

}  // namespace mpf::router
