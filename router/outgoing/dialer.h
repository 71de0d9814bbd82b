// SPDX-License-Identifier: MIT
// Dialer: opens connections to one remote router. It looks up the remote's name, tries its
// addresses one after the other, and does the TLS handshake unless the remote uses plain TCP.
//
//   look-up ─► address 1 ─ fails ─► address 2 ...
//   each address: TCP connection ─► TLS handshake
//
// A look-up occupies a thread until it ends. One that takes too long continues, and the next
// dial() waits for it instead of starting another one.
//
// Threads  that of the event loop.
#pragma once

#include <kj/async-io.h>
#include <string>
#include <vector>

#include "router/router_context.h"
#include "router/transport/kj_text.h"

namespace mpf::router {

class Dialer {
 public:
  // `context` and `remote` outlive this object.
  Dialer(RouterContext& context, const Remote& remote) : context_(context), remote_(remote) {}

  // Resolves with a connection that is ready for the greeting. This object outlives the promise.
  // Each step may take Limits::deadTime.
  //   throws  kj::Exception (the promise): its text names the step that failed, and why
  [[nodiscard]] kj::Promise<kj::Own<kj::AsyncIoStream>> dial();

 private:
  using Addresses = std::vector<std::string>;
  kj::Promise<Addresses> lookUp();
  kj::Promise<Addresses> startLookUp();
  kj::Promise<kj::Own<kj::AsyncIoStream>> connectToOne(Addresses addresses);
  kj::Promise<kj::Own<kj::AsyncIoStream>> connectTo(const std::string& address);
  template <class T>
  kj::Promise<T> withTimeout(const std::string& step, kj::Promise<T> promise) {
    return context_.timer.timeoutAfter(toKj(context_.config.limits.deadTime), kj::mv(promise))
        .catch_([this, step](kj::Exception&& error) -> kj::Promise<T> {
          return stepFailed(step, error);
        });
  }
  [[nodiscard]] kj::Exception stepFailed(const std::string& step, const kj::Exception& error) const;

  RouterContext& context_;
  const Remote& remote_;
  kj::Maybe<kj::ForkedPromise<Addresses>> lookUp_;  // until its result has been used
};

}  // namespace mpf::router
