// SPDX-License-Identifier: MIT
// ClientRouter: the connection to one remote router, for the clients of this host ("RMRClient" in
// the manual's report).
//
//   waiting ─time─► connecting ─greeted─► connected ─line ends─► waiting (longer each time)
//
//   pending binds ─► bind ─► the peer reports "there" ─► Proxy ... "absent" ─► drained, destroyed
//
// Threads  that of the event loop.
// Crash    when the line ends, for any reason, the proxies are destroyed. Their clients are
//          disconnected, publish pending binds, and are bound again after a reconnect.
#pragma once

#include <map>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "router/fatal_tasks.h"
#include "router/outgoing/connector.h"
#include "router/outgoing/proxy.h"

namespace mpf::router {

class ClientRouter final : public Line::Owner, public Proxy::Owner {
 public:
  ClientRouter(RouterContext& context, const Remote& remote);
  ~ClientRouter();

  [[nodiscard]] const Remote& remote() const noexcept { return remote_; }
  // Sets which servers the clients of this host wait for now, at any location.
  void setPendingBinds(const std::set<ServerName>& pendingBinds);
  // Ends the connection with a farewell. The promise resolves when it is closed.
  [[nodiscard]] kj::Promise<void> stop();

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
  kj::Promise<void> connectLoop();
  kj::Promise<LineEnd> runOnce();
  [[nodiscard]] kj::Duration nextDelay();
  void onLineEnd(const std::string& why);
  void bindWanted();
  void bind(const ServerName& name, Wanted& wanted);
  void makeProxy(const ServerName& name, Wanted& wanted);
  void onServer(wire::Server::Reader server);
  void onRefusal(const ServerName& name, Wanted& wanted, const std::string& why);
  void sweep();
  [[nodiscard]] bool isPending(const Wanted& wanted) const;
  void sweepSoon();

  // Line::Owner
  void onGreeting(const PeerGreeting& greeting) override;
  void onItem(wire::Item::Reader item) override;
  void onRoom() override;
  void onUnsendable(const Carried& carried, const std::string& why,
                    wire::Item::Builder instead) override;
  // Proxy::Owner
  Line& line() override { return *line_; }
  std::optional<std::uint32_t> tryNewClient(Proxy& proxy) override;
  void dropClient(std::uint32_t number) override;
  PeerRecord& record() override { return *record_; }
  const Log& log() override { return log_; }
  Proxy* proxyOf(std::uint32_t client);
  Proxy* openedProxyOf(std::uint32_t client);

  RouterContext& context_;
  Remote remote_;
  std::shared_ptr<PeerRecord> record_;
  std::unique_ptr<Line> line_;
  bool connected_ = false;
  bool stopping_ = false;
  std::string problem_;  // last logged reason why there is no connection
  std::map<ServerName, Wanted> wanted_;
  std::unordered_map<std::uint32_t, ServerName> bindings_;
  std::unordered_map<std::uint32_t, Proxy*> clients_;
  std::uint32_t lastBinding_ = 0;
  std::uint32_t lastClient_ = 0;
  bool maxClientsLogged_ = false;  // during this connection
  Log log_;
  Connector connector_;
  std::chrono::milliseconds retryDelay_{};
  std::int64_t connectedNs_ = 0;
  ServerName pumped_;  // the server whose requests were taken last
  Alarm pumpAgain_;
  std::minstd_rand random_{std::random_device{}()};
  Alarm sweeps_;
  kj::ForkedPromise<void> loop_ = nullptr;
  FatalTasks tasks_;
};

}  // namespace mpf::router
