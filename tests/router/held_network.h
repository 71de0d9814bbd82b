// SPDX-License-Identifier: MIT
// HeldNetwork: a network whose name look-ups end only when the test fulfills or rejects them, in
// any order.
//
//   HeldIo io;
//   Router router(io.context(), config, log);
//   ...
//   io.network().lookups[0]->reject(...);  or  ->fulfill(...)
//   io.run();
//
// Threads  one.
#pragma once

#include <kj/async-io.h>
#include <string>
#include <utility>
#include <vector>

namespace mpf::router::test {

using FoundAddress = kj::Own<kj::NetworkAddress>;

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wnon-virtual-dtor"  // kj::Own destroys the dynamic type
class HeldNetwork final : public kj::Network {
 public:
  explicit HeldNetwork(kj::Network& real) : real_(real) {}

  kj::Promise<FoundAddress> parseAddress(kj::StringPtr /*text*/, kj::uint /*port*/) override {
    auto found = kj::newPromiseAndFulfiller<FoundAddress>();
    lookups.push_back(kj::mv(found.fulfiller));
    return kj::mv(found.promise);
  }
  FoundAddress getSockaddr(const void* address, kj::uint length) override {
    return real_.getSockaddr(address, length);
  }
  kj::Own<kj::Network> restrictPeers(kj::ArrayPtr<const kj::StringPtr> allow,
                                     kj::ArrayPtr<const kj::StringPtr> deny) override {
    return real_.restrictPeers(allow, deny);
  }

  // In the order of the requests. isWaiting() is false for a look-up that has been cancelled.
  std::vector<kj::Own<kj::PromiseFulfiller<FoundAddress>>> lookups;

 private:
  kj::Network& real_;
};

class HeldIo {
 public:
  [[nodiscard]] kj::AsyncIoContext& context() noexcept { return held_; }
  [[nodiscard]] HeldNetwork& network() noexcept { return network_; }
  // Makes an address with which a look-up can be fulfilled.
  [[nodiscard]] FoundAddress addressOf(const std::string& text) {
    return real_.provider->getNetwork().parseAddress(text).wait(real_.waitScope);
  }
  // Runs the event loop until no task is ready.
  void run() { real_.waitScope.poll(); }

 private:
  struct Provider final : kj::AsyncIoProvider {
    Provider(kj::AsyncIoProvider& all, HeldNetwork& held) : real(all), network(held) {}
    kj::OneWayPipe newOneWayPipe() override { return real.newOneWayPipe(); }
    kj::TwoWayPipe newTwoWayPipe() override { return real.newTwoWayPipe(); }
    kj::Network& getNetwork() override { return network; }
    PipeThread newPipeThread(
        kj::Function<void(kj::AsyncIoProvider&, kj::AsyncIoStream&, kj::WaitScope&)> start)
        override {
      return real.newPipeThread(kj::mv(start));
    }
    kj::Timer& getTimer() override { return real.getTimer(); }
    kj::AsyncIoProvider& real;
    HeldNetwork& network;
  };
  kj::AsyncIoContext real_ = kj::setupAsyncIo();
  HeldNetwork network_{real_.provider->getNetwork()};
  kj::AsyncIoContext held_{
      {}, kj::heap<Provider>(*real_.provider, network_), real_.waitScope, real_.unixEventPort};
};

#pragma GCC diagnostic pop

}  // namespace mpf::router::test
