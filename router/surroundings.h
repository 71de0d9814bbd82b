// SPDX-License-Identifier: MIT
// Surroundings: what every part of a router works with.
//
// Threads  that of the event loop.
#pragma once

#include <kj/async-io.h>
#include <kj/async-unix.h>
#include <memory>

#include <mpf/backplane.h>

#include "router/config/router_config.h"
#include "router/incoming/presences.h"
#include "router/statistics.h"
#include "router/transport/tls.h"
#include "schema/router.capnp.h"
#include "server/programs/log.h"

namespace mpf::router {

struct Surroundings {
  kj::UnixEventPort& port;
  kj::Network& network;
  kj::Timer& timer;
  Backplane backplane;
  Log log;
  Statistics& statistics;
  Presences& presences;
  RouterConfig config;                 // as it is now; a reload changes it
  std::shared_ptr<Tls> tls;            // nullptr: nothing uses TLS
  std::uint64_t incarnation = 0;       // which life of this router
};

// Options of every TCP connection, before TLS.
void prepare(kj::AsyncIoStream& stream, const Limits& limits);

// An address's host as kj parses it.
[[nodiscard]] std::string hostForKj(const Address& address);

// Throws std::runtime_error when plain TCP to or on one of these is not allowed.
void checkPlain(kj::NetworkAddress& address, const RouterConfig& config);

// What this router says of itself; the rest of its greeting is the caller's.
void introduce(wire::Greeting::Builder greeting, const Surroundings& here);

}  // namespace mpf::router
