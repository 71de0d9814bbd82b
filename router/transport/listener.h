// SPDX-License-Identifier: MIT
// Listener: one listening address. It accepts callers, over TLS unless the configuration says
// plain, and hands them on.
//
//   accept ─► first byte ─ TLS ──► handshake ─► OnCaller
//                        ├ frame ► a farewell in plain TCP: this port expects TLS
//                        └ other ► closed
//
// Threads  that of the event loop.
// Trust    a caller has Limits::handshakeTime for its handshake, first byte included. Of too many
//          handshakes, the oldest one of the host with the most makes room: callers that idle keep
//          no other host out.
#pragma once

#include <functional>
#include <kj/async-io.h>
#include <map>
#include <string>

#include "router/surroundings.h"
#include "router/transport/turned_away.h"

namespace mpf::router {

class Listener final : private kj::TaskSet::ErrorHandler {
 public:
  struct Caller {
    kj::Own<kj::AsyncIoStream> stream;
    std::string name;  // common name of its certificate; empty: plain
    std::string address;
    bool isTls = false;
  };
  using OnCaller = std::function<void(Caller)>;

  Listener(Surroundings& here, const Listen& listen, OnCaller onCaller);

  // Resolves once it listens. The look-up of its name is the Listener's own and ends with it: who
  // waits has the result and no more.
  //   throws  kj::Exception (the promise): the address is in use, is none, or is public and plain;
  //           or the Listener has gone before
  [[nodiscard]] kj::Promise<void> start();
  [[nodiscard]] const Listen& listen() const noexcept { return listen_; }
  // With the port that the kernel chose.
  [[nodiscard]] Address address();

 private:
  kj::Promise<void> open();
  kj::Promise<void> acceptLoop();
  void admit(kj::AuthenticatedStream caller);
  void shakeHands(kj::AuthenticatedStream caller, const std::string& address);
  kj::Promise<void> handshake(kj::AuthenticatedStream caller, const std::string& address);
  kj::Promise<void> openTls(kj::AuthenticatedStream caller, kj::byte first,
                            const std::string& address);
  void makeRoom();
  void taskFailed(kj::Exception&& error) override;

  Surroundings& here_;
  Listen listen_;
  OnCaller onCaller_;
  std::vector<kj::Own<kj::ConnectionReceiver>> receivers_;
  struct Handshake {
    std::string host;
    kj::Own<kj::PromiseFulfiller<void>> end;  // fulfilling it closes the connection
  };
  std::map<std::uint64_t, Handshake> handshakes_;  // under way, the oldest one first
  std::uint64_t lastHandshake_ = 0;
  std::string problem_;  // of accepting, that was logged last
  TurnedAway turnedAway_;
  kj::TaskSet tasks_;
};

}  // namespace mpf::router
