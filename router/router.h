// SPDX-License-Identifier: MIT
// Router: joins this host's backplane to those of other hosts, with a ClientRouter for each remote
// and a ServerRouter for each accepted connection.
//
//   pending binds here ─► ClientRouter ══ TCP ══ ServerRouter on another host
//   servers here ◄── ServerRouter ══ TCP ══ ClientRouter on another host
//
// Calls go one way: an object makes its parts, hands them what they use, and calls them. A
// part that has something to report has a struct Events of named functions; the object that makes
// the part fills them in there (Line::Events, FarClient::Events). The path of a message:
//
//   request  local client ─► RemoteServers::pump ─► Proxy::pump ─► Line::send ═► Line::handle ─►
//            LocalServers::handle ─► FarClient::request ─► server
//   reply    server ─► FarClient::onMessage ─► Line::send ═► Line::handle ─►
//            RemoteServers::handle ─► Proxy::reply ─► local client
//
// Threads  that of the event loop.
// Crash    an error on one connection ends that connection only.
#pragma once

#include <list>
#include <memory>

#include "router/alarm.h"
#include "router/incoming/server_router.h"
#include "router/outgoing/client_router.h"
#include "router/outgoing/pending_binds.h"
#include "router/transport/listener.h"
#include "shm/watcher.h"

namespace mpf::router {

class Router final : private kj::TaskSet::ErrorHandler {
 public:
  //   throws  ConfigError (TLS files), std::system_error
  Router(kj::AsyncIoContext& io, const RouterConfig& config, const Log& log);
  ~Router();

  // Resolves when all listening addresses of the configuration are open.
  [[nodiscard]] kj::Promise<void> start();
  [[nodiscard]] std::vector<Address> listening();
  // Replaces the configuration. Connections whose entries are unchanged continue. New limits and
  // TLS files apply to new connections.
  //   throws  ConfigError (TLS files); then nothing has changed
  void reload(const RouterConfig& config);
  // Ends all connections with a farewell.
  [[nodiscard]] kj::Promise<void> stop();

 private:
  void openTls(const RouterConfig& config);
  void replaceConfig(const RouterConfig& config);
  Listener& listen(const Listen& listen);
  void listenAfterReload(const Listen& listen);
  void onCaller(const Listen& listen, Listener::Caller caller);
  bool tryMakeRoom();
  void lookAtServers();
  void readPendingBindsSoon();
  void readPendingBinds();
  void taskFailed(kj::Exception&& error) override;

  struct Session {
    Listen listen;  // the address that accepted it
    std::unique_ptr<ServerRouter> router;
    std::string host;  // of the peer
    kj::Own<kj::PromiseFulfiller<void>> end;  // fulfilling it closes the connection; nullptr: done
  };

  Statistics statistics_;
  RouterContext context_;
  Polling polling_;
  ServerMonitors monitors_;
  PendingBinds pendingBinds_;
  Bell bell_;
  Watcher::Token names_;
  std::list<std::shared_ptr<Listener>> listeners_;
  std::list<std::unique_ptr<ClientRouter>> remotes_;
  std::list<Session> sessions_;
  Alarm pendingBindsDue_;
  std::string pendingBindProblem_;  // last problem that was logged
  RefusedPeers refusedPeers_;
  kj::TaskSet tasks_;
};

}  // namespace mpf::router
