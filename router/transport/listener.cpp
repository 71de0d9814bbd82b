// SPDX-License-Identifier: MIT
#include "router/transport/listener.h"

#include <algorithm>
#include <fmt/format.h>
#include <kj/debug.h>

#include "router/transport/first_byte.h"
#include "router/transport/kj_text.h"

namespace mpf::router {
namespace {

// Pause after a failure to accept, for example because no descriptor is left.
constexpr auto kAfterFailure = 100 * kj::MILLISECONDS;

constexpr std::size_t kMaxHandshakes = 256;

constexpr const char* kExpectsTls =
    "this port expects TLS: write security = \"tls\" for this remote and the files in [tls], or "
    "leave out --plain";

// The address of the peer.
std::string addressOf(kj::PeerIdentity& identity) {
  const auto text = identity.toString();
  return {text.begin(), text.size()};
}

}  // namespace

Listener::Listener(RouterContext& context, const Listen& listen, OnCaller onCaller)
    : context_(context),
      listen_(listen),
      onCaller_(std::move(onCaller)),
      refusedPeers_(context.timer),
      tasks_(*this) {}

kj::Promise<void> Listener::start() {
  auto started = kj::newPromiseAndFulfiller<void>();
  auto& result = *started.fulfiller;
  tasks_.add(open()
                 .then([&result] { result.fulfill(); },
                       [this, &result](kj::Exception&& error) {
                         const auto text = fmt::format("cannot listen at {}: {}",
                                                       listen_.address.text(), reasonOf(error));
                         result.reject({kj::Exception::Type::FAILED, __FILE__, __LINE__,
                                        kj::heapString(text)});
                       })
                 .attach(kj::mv(started.fulfiller)));
  return kj::mv(started.promise);
}

kj::Promise<void> Listener::open() {
  return kj::evalNow([this] {
           return context_.network.parseAddress(hostForKj(listen_.address), listen_.address.port);
         })
      .then([this](kj::Own<kj::NetworkAddress> address) {
        if (listen_.security == Security::plain) checkPlain(*address, context_.config);
        receivers_.push_back(address->listen());
        tasks_.add(acceptLoop());
      });
}

Address Listener::address() {
  auto address = listen_.address;
  if (!receivers_.empty()) address.port = static_cast<std::uint16_t>(receivers_.front()->getPort());
  return address;
}

// An error with one connection does not prevent the next one from being accepted.
// acceptAuthenticated() may also throw an error directly.
kj::Promise<void> Listener::acceptLoop() {
  return kj::evalNow([this] { return receivers_.front()->acceptAuthenticated(); })
      .then([this](kj::AuthenticatedStream caller) {
        admit(kj::mv(caller));
        problem_.clear();
      })
      .then([]() -> kj::Promise<void> { return kj::READY_NOW; },
            [this](kj::Exception&& error) -> kj::Promise<void> {
              const auto why = toStd(error.getDescription());
              if (problem_ != why)
                context_.log.warn("{}: cannot accept a connection, trying again: {}",
                                  listen_.address.text(), why);
              problem_ = why;
              return context_.timer.afterDelay(kAfterFailure);
            })
      .then([this] { return acceptLoop(); });
}

void Listener::admit(kj::AuthenticatedStream caller) {
  auto address = addressOf(*caller.peerIdentity);
  setSocketOptions(*caller.stream, context_.config.limits);
  if (listen_.security == Security::plain)
    return onCaller_({kj::mv(caller.stream), {}, std::move(address), false});
  startHandshake(kj::mv(caller), address);
}

void Listener::startHandshake(kj::AuthenticatedStream caller, const std::string& address) {
  if (handshakes_.size() >= kMaxHandshakes) makeRoom();
  auto end = kj::newPromiseAndFulfiller<void>();
  const auto number = ++lastHandshake_;
  handshakes_[number] = {hostOf(address), kj::mv(end.fulfiller)};
  tasks_.add(context_.timer
                 .timeoutAfter(toKj(context_.config.limits.handshakeTime),
                               kj::evalNow([&] { return handshake(kj::mv(caller), address); }))
                 .then([]() {},
                       [this, address](kj::Exception&& error) {
                         context_.log.warn("{}: the TLS handshake failed: {}", address,
                                           tlsProblem(error));
                       })
                 .exclusiveJoin(kj::mv(end.promise))
                 .attach(kj::defer([this, number] { handshakes_.erase(number); })));
}

// Closes the oldest handshake of the host with the most handshakes.
void Listener::makeRoom() {
  std::map<std::string, std::size_t> counts;
  for (const auto& [number, each] : handshakes_) ++counts[each.host];
  const auto most =
      std::ranges::max_element(counts, {}, [](const auto& each) { return each.second; })->second;
  const auto victim = std::ranges::find_if(
      handshakes_, [&](const auto& each) { return counts[each.second.host] == most; });
  context_.log.warn(
      "{}: {} TLS handshakes are in progress, {} of them with {}: closing the oldest of these",
      listen_.address.text(), handshakes_.size(), most, victim->second.host);
  victim->second.end->fulfill();
  handshakes_.erase(victim);
}

kj::Promise<void> Listener::handshake(kj::AuthenticatedStream caller, const std::string& address) {
  auto identity = kj::mv(caller.peerIdentity);
  return readFirstByte(kj::mv(caller.stream))
      .then([this, address,
             identity = kj::mv(identity)](FirstByte first) mutable -> kj::Promise<void> {
        KJ_IF_MAYBE (byte, first.value)
          return openTls({kj::mv(first.stream), kj::mv(identity)}, *byte, address);
        return KJ_EXCEPTION(DISCONNECTED, "the peer closed the connection before it sent anything");
      });
}

kj::Promise<void> Listener::openTls(kj::AuthenticatedStream caller, kj::byte first,
                                    const std::string& address) {
  if (first == kFrameByte) {
    refusedPeers_.add(kj::mv(caller.stream), FarewellCode::PROTOCOL, kExpectsTls);
    return KJ_EXCEPTION(FAILED,
                        "the peer uses plain TCP, and this port expects TLS: set the same "
                        "security at both routers");
  }
  return context_.tls->accept(kj::mv(caller)).then([this, address](kj::AuthenticatedStream peer) {
    const auto name = peerName(*peer.peerIdentity);
    onCaller_({kj::mv(peer.stream), name, address, true});
  });
}

void Listener::taskFailed(kj::Exception&& error) {
  context_.log.error("{}: {}", listen_.address.text(), toStd(error.getDescription()));
}

}  // namespace mpf::router
