// SPDX-License-Identifier: MIT
// Router: joins this host's backplane to those of others: a ClientRouter for each remote, a
// ServerRouter for each caller.
//
//   pending binds here ─► ClientRouter ══ TCP ══ ServerRouter elsewhere
//   servers here ◄── ServerRouter ══ TCP ══ ClientRouter elsewhere
//
// Threads  that of the event loop.
// Crash    whatever ends a connection ends that connection.
#pragma once

#include <list>
#include <memory>

#include "router/alarm.h"
#include "router/incoming/server_router.h"
#include "router/outgoing/client_router.h"
#include "router/transport/listener.h"
#include "shm/watcher.h"

namespace mpf::router {

class Router final : private kj::TaskSet::ErrorHandler {
 public:
  //   throws  ConfigError (TLS files), std::system_error
  Router(kj::AsyncIoContext& io, const RouterConfig& config, const Log& log);
  ~Router();

  // Resolves once it listens everywhere that it shall.
  [[nodiscard]] kj::Promise<void> start();
  [[nodiscard]] std::vector<Address> listening();
  // Keeps what stays the same: its connections notice nothing. Limits and TLS files hold for
  // connections made from now on.
  //   throws  ConfigError (TLS files), and nothing has changed
  void reload(const RouterConfig& config);
  // Says farewell to everybody.
  [[nodiscard]] kj::Promise<void> stop();

 private:
  void openTls(const RouterConfig& config);
  Listener& listen(const Listen& listen);
  void listenLate(const Listen& listen);
  void onCaller(const Listen& listen, Listener::Caller caller);
  bool tryMakeRoom();
  void lookAtServers();
  void lookAtPendingBinds();
  void readPendingBinds();
  void taskFailed(kj::Exception&& error) override;

  struct Session {
    Listen listen;  // where it called
    std::unique_ptr<ServerRouter> router;
    std::string host;  // that called
    kj::Own<kj::PromiseFulfiller<void>> end;  // fulfilling it closes the connection; nullptr: done
  };

  Statistics statistics_;
  Surroundings here_;
  Presences presences_;
  PendingBinds pendingBinds_;
  Bell bell_;
  Watcher::Token names_;
  std::list<std::shared_ptr<Listener>> listeners_;
  std::list<std::unique_ptr<ClientRouter>> remotes_;
  std::list<Session> sessions_;
  Alarm pendingBindsDue_;
  std::string pendingBindProblem_;  // that was logged last
  TurnedAway turnedAway_;
  kj::TaskSet tasks_;
};

}  // namespace mpf::router
