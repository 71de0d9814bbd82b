// SPDX-License-Identifier: MIT
// Tls: TCP connections on which both sides have shown a certificate that one of our authorities
// signed.
//
// TLS 1.3, so the client side has done its part before the server side has looked at its
// certificate: a client that is refused is told by its first read, not by connect().
//
// Threads  that of the event loop.
// Crash    a connection outlives the Tls that made it: a reloaded configuration makes a new one,
//          and what is connected stays.
// Trust    whoever shows no certificate, one of another authority or an expired one, speaks
//          something else or stops speaking, costs itself the connection. There are no revocation
//          lists: replace the authority, or leave the name out of [[allow]].
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
  //   throws     ConfigError that names the file and says what is wrong with it
  Tls(const TlsFiles& files, kj::Timer& timer, std::chrono::milliseconds handshake = kHandshake);

  // The connection as TLS, once the handshake is over. The promise breaks when that fails;
  // tlsTrouble() says why.
  [[nodiscard]] kj::Promise<kj::AuthenticatedStream> accept(kj::AuthenticatedStream connection);
  //   name  that the certificate of the other side must have: Remote::tlsName
  [[nodiscard]] kj::Promise<kj::AuthenticatedStream> connect(kj::AuthenticatedStream connection,
                                                             const std::string& name);

  static constexpr std::chrono::seconds kHandshake{10};

 private:
  kj::Promise<kj::AuthenticatedStream> limited(kj::Promise<kj::AuthenticatedStream> handshake);

  kj::Timer& timer_;
  kj::Duration handshake_;
  kj::TlsContext server_;
  kj::TlsContext client_;
};

// The common name of the peer's certificate; empty when it has none, as on plain TCP.
[[nodiscard]] std::string peerName(kj::PeerIdentity& peer);

// Why a handshake failed, or the first read after it, as people read it.
[[nodiscard]] std::string tlsTrouble(const kj::Exception& error);

}  // namespace mpf::router
