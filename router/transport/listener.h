// SPDX-License-Identifier: MIT
// Listener: one listening address. It accepts connections, does the TLS handshake unless the
// configuration selects plain TCP, and hands the connections to its owner.
//
//   accept ─► first byte ─ TLS ──► handshake ─► OnCaller
//                        ├ frame ► a farewell over plain TCP: this port expects TLS
//                        └ other ► closed
//
// Threads  that of the event loop.
// Trust    a peer has Limits::handshakeTime for its handshake, including the first byte. When too
//          many handshakes are in progress, the oldest one of the host with the most is closed, so
//          that idle connections of one host do not keep other hosts out.
#pragma once

#include <functional>
#include <kj/async-io.h>
#include <map>
#include <string>

#include "router/router_context.h"
#include "router/transport/refused_peers.h"

namespace mpf::router {

class Listener final : private kj::TaskSet::ErrorHandler {
 public:
  struct Caller {
    kj::Own<kj::AsyncIoStream> stream;
    std::string name;  // common name of its certificate; empty: plain TCP
    std::string address;
    bool isTls = false;
  };
  using OnCaller = std::function<void(Caller)>;

  Listener(RouterContext& context, const Listen& listen, OnCaller onCaller);

  // Resolves when it listens. Dropping the promise does not cancel the start; destroying the
  // Listener does.
  //   throws  kj::Exception (the promise): the address is in use, is invalid, or is public and
  //           plain; or the Listener was destroyed before
  [[nodiscard]] kj::Promise<void> start();
  [[nodiscard]] const Listen& listen() const noexcept { return listen_; }
  // The listening address, with the port that the kernel chose.
  [[nodiscard]] Address address();

 private:
  kj::Promise<void> open();
  kj::Promise<void> acceptLoop();
  void admit(kj::AuthenticatedStream caller);
  void startHandshake(kj::AuthenticatedStream caller, const std::string& address);
  kj::Promise<void> handshake(kj::AuthenticatedStream caller, const std::string& address);
  kj::Promise<void> openTls(kj::AuthenticatedStream caller, kj::byte first,
                            const std::string& address);
  void makeRoom();
  void taskFailed(kj::Exception&& error) override;

  RouterContext& context_;
  Listen listen_;
  OnCaller onCaller_;
  std::vector<kj::Own<kj::ConnectionReceiver>> receivers_;
  struct Handshake {
    std::string host;
    kj::Own<kj::PromiseFulfiller<void>> end;  // fulfilling it closes the connection
  };
  std::map<std::uint64_t, Handshake> handshakes_;  // in progress, the oldest one first
  std::uint64_t lastHandshake_ = 0;
  std::string problem_;  // last error of accepting that was logged
  RefusedPeers refusedPeers_;
  kj::TaskSet tasks_;
};

}  // namespace mpf::router
