// SPDX-License-Identifier: MIT
#include <mpf/router/listener.h>

#include <fmt/format.h>

#include <mpf/router/kj_text.h>

namespace mpf::router {
namespace {

constexpr auto kAfterFailure = 100 * kj::MILLISECONDS;  // no descriptor left, say: others may close theirs

constexpr std::size_t kMaxHandshakes = 256;

// Where somebody called from, or says it did.
std::string addressOf(kj::PeerIdentity& identity) {
  const auto text = identity.toString();
  return {text.begin(), text.size()};
}

}  // namespace

Listener::Listener(Surroundings& here, const Listen& listen, OnCaller onCaller)
    : here_(here), listen_(listen), onCaller_(std::move(onCaller)), tasks_(*this) {}

kj::Promise<void> Listener::start() {
  auto started = kj::newPromiseAndFulfiller<void>();
  auto& result = *started.fulfiller;
  tasks_.add(open()
                 .then([&result] { result.fulfill(); }, [&result](kj::Exception&& error) { result.reject(kj::mv(error)); })
                 .attach(kj::mv(started.fulfiller)));
  return kj::mv(started.promise);
}

kj::Promise<void> Listener::open() {
  return kj::evalNow([this] { return here_.network.parseAddress(hostForKj(listen_.address), listen_.address.port); })
      .then([this](kj::Own<kj::NetworkAddress> address) {
        if (listen_.security == Security::plain) checkPlain(*address, here_.config);
        receivers_.push_back(address->listen());
        tasks_.add(acceptLoop());
      });
}

Address Listener::address() {
  auto address = listen_.address;
  if (!receivers_.empty()) address.port = static_cast<std::uint16_t>(receivers_.front()->getPort());
  return address;
}

// Whatever goes wrong with one caller, the next one is heard. It may go wrong at once: acceptAuthenticated() throws that.
kj::Promise<void> Listener::acceptLoop() {
  return kj::evalNow([this] { return receivers_.front()->acceptAuthenticated(); })
      .then([this](kj::AuthenticatedStream caller) {
        admit(kj::mv(caller));
        problem_.clear();
      })
      .then([]() -> kj::Promise<void> { return kj::READY_NOW; },
            [this](kj::Exception&& error) -> kj::Promise<void> {
              const auto why = toStd(error.getDescription());
              if (problem_ != why) here_.log.warn("{}: accept: {}", listen_.address.text(), why);
              problem_ = why;
              return here_.timer.afterDelay(kAfterFailure);
            })
      .then([this] { return acceptLoop(); });
}

void Listener::admit(kj::AuthenticatedStream caller) {
  auto address = addressOf(*caller.peerIdentity);
  prepare(*caller.stream, here_.config.limits);
  if (listen_.security == Security::plain) return onCaller_({kj::mv(caller.stream), {}, std::move(address), false});
  shakeHands(kj::mv(caller), address);
}

void Listener::shakeHands(kj::AuthenticatedStream caller, const std::string& address) {
  if (handshakes_.size() >= kMaxHandshakes) {
    here_.log.warn("{}: {} TLS handshakes are under way: the oldest one makes room", listen_.address.text(), handshakes_.size());
    handshakes_.begin()->second->fulfill();
    handshakes_.erase(handshakes_.begin());
  }
  auto cancel = kj::newPromiseAndFulfiller<void>();
  const auto number = ++lastHandshake_;
  handshakes_[number] = kj::mv(cancel.fulfiller);
  tasks_.add(kj::evalNow([&] { return here_.tls->accept(kj::mv(caller)); })
                 .then(
                     [this, address, number](kj::AuthenticatedStream peer) {
                       handshakes_.erase(number);
                       const auto name = peerName(*peer.peerIdentity);
                       onCaller_({kj::mv(peer.stream), name, address, true});
                     },
                     [this, address, number](kj::Exception&& error) {
                       handshakes_.erase(number);
                       here_.log.warn("{}: no TLS with it: {}", address, tlsTrouble(error));
                     })
                 .exclusiveJoin(kj::mv(cancel.promise)));
}

void Listener::taskFailed(kj::Exception&& error) { here_.log.error("{}: {}", listen_.address.text(), toStd(error.getDescription())); }

}  // namespace mpf::router
