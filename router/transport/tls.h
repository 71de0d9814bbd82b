// SPDX-License-Identifier: MIT
// Tls: wraps TCP connections in TLS. Both sides must present a certificate that one of the
// configured authorities has signed.
//
// With TLS 1.3 the client side completes its handshake before the server side has checked the
// client's certificate. A client that is refused sees this at its first read, not in connect().
//
// Threads  that of the event loop.
// Crash    a connection outlives the Tls that created it. A reload creates a new Tls, and existing
//          connections continue.
// Trust    a peer without a certificate, with a certificate that is expired or from another
//          authority, or with invalid or incomplete data loses its connection. Revocation lists are
//          not supported: replace the authority, or remove the name from [[allow]].
#pragma once

#include <chrono>
#include <kj/compat/tls.h>
#include <string>

#include "router/config/router_config.h"

namespace mpf::router {

class Tls {
 public:
  //   timer      outlives this object
  //   handshake  longest time from the connection to the end of the handshake
  //   throws     ConfigError that names the file and its error
  Tls(const TlsFiles& files, kj::Timer& timer, std::chrono::milliseconds handshake);

  // Resolves with the TLS connection after the handshake. If the handshake fails, tlsProblem() of
  // the exception says why.
  [[nodiscard]] kj::Promise<kj::AuthenticatedStream> accept(kj::AuthenticatedStream connection);
  //   name  the name that the certificate of the peer must have: Remote::tlsName
  [[nodiscard]] kj::Promise<kj::AuthenticatedStream> connect(kj::AuthenticatedStream connection,
                                                             const std::string& name);

 private:
  kj::Promise<kj::AuthenticatedStream> limited(kj::Promise<kj::AuthenticatedStream> handshake);

  kj::Timer& timer_;
  kj::Duration handshake_;
  kj::TlsContext server_;
  kj::TlsContext client_;
};

// The common name of the peer's certificate; empty when it has no common name, and on plain TCP.
[[nodiscard]] std::string peerName(kj::PeerIdentity& peer);

// Says in plain words why a handshake, or the first read after it, has failed.
//   expectedName  `name` of connect(), if it failed
[[nodiscard]] std::string tlsProblem(const kj::Exception& error,
                                     const std::string& expectedName = {});

}  // namespace mpf::router
