// SPDX-License-Identifier: MIT
// ClientRouter: keeps a connection to one remote router, for the clients of this host ("RMRClient"
// in the manual's report).
//
// States:
//   waiting ─ time ─► connecting ─ greeted ─► connected
//      ▲                  │ failed                │ the line has ended
//      └──────────────────┴───────────────────────┘      waits longer each time
//   any ─ stop() ─► stopping
//
//   ClientRouter ─► Dialer         opens a connection
//                ├► Line           sends and receives its frames
//                └► RemoteServers  the servers that local clients use over it, a Proxy for each
//
// Threads  that of the event loop.
// Crash    when the line ends, for any reason, the proxies are destroyed. Their clients are
//          disconnected, publish pending binds, and are bound again after a reconnect.
#pragma once

#include <memory>
#include <random>
#include <set>
#include <string>

#include "router/fatal_tasks.h"
#include "router/outgoing/dialer.h"
#include "router/outgoing/remote_servers.h"
#include "router/transport/line.h"

namespace mpf::router {

class ClientRouter {
 public:
  ClientRouter(RouterContext& context, const Remote& remote);
  ~ClientRouter();
  ClientRouter(const ClientRouter&) = delete;
  ClientRouter& operator=(const ClientRouter&) = delete;

  [[nodiscard]] const Remote& remote() const noexcept { return remote_; }
  // Sets which servers the clients of this host wait for now, at any location.
  void setPendingBinds(const std::set<ServerName>& pendingBinds) {
    servers_.setPendingBinds(pendingBinds);
  }
  // Ends the connection with a farewell. The promise resolves when it is closed, and the local
  // clients have had the time to receive what has arrived. Call it once.
  [[nodiscard]] kj::Promise<void> stop();

 private:
  enum class State { waiting, connecting, connected, stopping };

  kj::Promise<void> connectLoop();
  kj::Promise<LineEnd> runOnce();
  kj::Promise<LineEnd> runLine(kj::Own<kj::AsyncIoStream> stream);
  [[nodiscard]] kj::Duration nextDelay();
  void onGreeting(const PeerGreeting& greeting);
  void onLineEnd(const std::string& why);
  void logEnd(const std::string& why);

  RouterContext& context_;
  Remote remote_;
  std::shared_ptr<PeerRecord> record_;
  Log log_;
  State state_ = State::waiting;
  std::string problem_;  // last logged reason why there is no connection
  std::chrono::milliseconds retryDelay_;
  std::int64_t connectedNs_ = 0;
  std::minstd_rand random_{std::random_device{}()};
  Dialer dialer_;
  std::unique_ptr<Line> line_;
  RemoteServers servers_;
  kj::ForkedPromise<void> loop_ = nullptr;
  FatalTasks tasks_;
};

}  // namespace mpf::router
