// SPDX-License-Identifier: MIT
// ServerRouter: one accepted connection from the client router of another host ("RMRServer" in the
// manual's report).
//
//   ServerRouter ─► Line          sends and receives its frames
//                └► LocalServers  the servers of this host that the peer's clients use, and for
//                                 each client a FarClient
//
// Threads  that of the event loop.
// Crash    when the line ends, its clients disconnect from the servers.
#pragma once

#include <memory>
#include <string>

#include "router/incoming/local_servers.h"
#include "router/router_context.h"
#include "router/transport/line.h"

namespace mpf::router {

class ServerRouter {
 public:
  //   peer     the common name of the peer's certificate; empty: plain TCP
  //   address  the address from which the peer has connected
  ServerRouter(RouterContext& context, kj::Own<kj::AsyncIoStream> stream, const std::string& peer,
               const std::string& address, bool isTls);
  ServerRouter(const ServerRouter&) = delete;
  ServerRouter& operator=(const ServerRouter&) = delete;

  // Resolves when the line has ended.
  [[nodiscard]] kj::Promise<void> run();
  // Ends the line with a farewell.
  void stop();
  [[nodiscard]] bool hasGreeted() const noexcept { return line_.hasGreeted(); }
  // The served locations or the rules in [[allow]] have changed.
  void onConfig();
  // Servers may have started or ended: ServerMonitors has looked at all.
  void onServers() { servers_.onServers(); }

 private:
  [[nodiscard]] Line::Events lineEvents();
  void greet(wire::Greeting::Builder greeting) const;
  void onGreeting(const PeerGreeting& greeting);
  void setRecordLocations();

  RouterContext& context_;
  std::string peer_;
  std::string address_;
  std::shared_ptr<PeerRecord> record_;
  Line line_;
  LocalServers servers_;
};

}  // namespace mpf::router
