// SPDX-License-Identifier: MIT
// Listener: one listening address. Who calls there is let in, over TLS unless the configuration says plain, and handed on.
//
// Threads  that of the event loop.
// Trust    a handshake has a time limit; of too many the oldest makes room, so that who idles locks nobody out.
#pragma once

#include <functional>
#include <kj/async-io.h>
#include <map>
#include <string>

#include <mpf/router/surroundings.h>

namespace mpf::router {

class Listener final : private kj::TaskSet::ErrorHandler {
 public:
  struct Caller {
    kj::Own<kj::AsyncIoStream> stream;
    std::string name;     // common name of its certificate; empty: plain
    std::string address;
    bool isTls = false;
  };
  using OnCaller = std::function<void(Caller)>;

  Listener(Surroundings& here, const Listen& listen, OnCaller onCaller);

  // Resolves once it listens. The look-up of its name is the Listener's own and ends with it: who waits has the result and no more.
  //   throws  kj::Exception (the promise): the address is in use, is none, or is public and plain; or the Listener has gone before
  [[nodiscard]] kj::Promise<void> start();
  [[nodiscard]] const Listen& listen() const noexcept { return listen_; }
  // With the port that the kernel chose.
  [[nodiscard]] Address address();

 private:
  kj::Promise<void> open();
  kj::Promise<void> acceptLoop();
  void admit(kj::AuthenticatedStream caller);
  void shakeHands(kj::AuthenticatedStream caller, const std::string& address);
  void taskFailed(kj::Exception&& error) override;

  Surroundings& here_;
  Listen listen_;
  OnCaller onCaller_;
  std::vector<kj::Own<kj::ConnectionReceiver>> receivers_;
  std::map<std::uint64_t, kj::Own<kj::PromiseFulfiller<void>>> handshakes_;  // under way, in order; fulfilling one ends it
  std::uint64_t lastHandshake_ = 0;
  std::string problem_;  // of accepting, that was logged last
  kj::TaskSet tasks_;
};

}  // namespace mpf::router
