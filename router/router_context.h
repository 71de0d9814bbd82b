// SPDX-License-Identifier: MIT
// RouterContext: the objects that all parts of a router share.
//
// Threads  that of the event loop.
#pragma once

#include <kj/async-io.h>
#include <kj/async-unix.h>
#include <memory>

#include <mpf/backplane.h>

#include "router/config/router_config.h"
#include "router/incoming/server_monitors.h"
#include "router/polling.h"
#include "router/statistics.h"
#include "router/transport/tls.h"
#include "schema/router.capnp.h"
#include "server/programs/log.h"

namespace mpf::router {

struct RouterContext {
  kj::UnixEventPort& port;
  kj::Network& network;
  kj::Timer& timer;
  Backplane backplane;
  Log log;
  Statistics& statistics;
  ServerMonitors& monitors;
  RouterConfig config;            // replaced by a reload
  std::shared_ptr<Tls> tls;       // nullptr: no connection uses TLS
  std::uint64_t incarnation = 0;  // distinguishes restarts of this router
  Polling* polling = nullptr;     // nullptr: the router never polls
  DueWrites writes{timer};

  // As the functions of Polling.
  void noteTraffic() const {
    if (polling != nullptr) polling->noteTraffic();
  }
  void poll(Polled& window) const {
    if (polling != nullptr) polling->addWindow(window);
  }
  void lookForAnswers() const {
    if (polling != nullptr) polling->lookForAnswers();
  }
  void endPolling(Polled& window) const noexcept {
    if (polling != nullptr) polling->remove(window);
  }
};

// Sets the socket options of a TCP connection, before TLS.
void setSocketOptions(kj::AsyncIoStream& stream, const Limits& limits);

// The host of an address in the form that kj parses.
[[nodiscard]] std::string hostForKj(const Address& address);

// Throws std::runtime_error when plain TCP is not allowed with one of these addresses.
void checkPlain(kj::NetworkAddress& address, const RouterConfig& config);

// Fills in the fields of a greeting that are the same for client and server routers.
void fillGreeting(wire::Greeting::Builder greeting, const RouterContext& context);

}  // namespace mpf::router
