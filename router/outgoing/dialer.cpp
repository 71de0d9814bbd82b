// SPDX-License-Identifier: MIT
#include "router/outgoing/dialer.h"

#include <fmt/format.h>
#include <kj/debug.h>
#include <sstream>
#include <utility>

#include "router/config/limit_text.h"

namespace mpf::router {

// A name may have several addresses, and the first of them may not answer.
kj::Promise<kj::Own<kj::AsyncIoStream>> Dialer::dial() {
  return withTimeout(fmt::format("the look-up of {}", remote_.address.host), lookUp())
      .then([this](Addresses&& addresses) { return connectToOne(std::move(addresses)); });
}

kj::Promise<Dialer::Addresses> Dialer::lookUp() {
  if (lookUp_ == nullptr) lookUp_ = startLookUp().fork();
  return KJ_ASSERT_NONNULL(lookUp_).addBranch().then(
      [this](Addresses&& addresses) -> kj::Promise<Addresses> {
        lookUp_ = nullptr;
        return std::move(addresses);
      },
      [this](kj::Exception&& error) -> kj::Promise<Addresses> {
        lookUp_ = nullptr;
        return kj::mv(error);
      });
}

kj::Promise<Dialer::Addresses> Dialer::startLookUp() {
  const auto& address = remote_.address;
  return kj::evalNow(
             [&] { return context_.network.parseAddress(hostForKj(address), address.port); })
      .then([this](kj::Own<kj::NetworkAddress> parsed) {
        if (remote_.security == Security::plain) checkPlain(*parsed, context_.config);
        Addresses addresses;
        std::istringstream all(toStd(parsed->toString()));
        for (std::string one; std::getline(all, one, ',');) addresses.push_back(one);
        return addresses;
      });
}

kj::Exception Dialer::stepFailed(const std::string& step, const kj::Exception& error) const {
  const auto deadTime = limitText(context_.config.limits, "dead-time");
  const auto why = reasonOf(error);
  const auto text = why == kTimeout
                        ? fmt::format("{} took longer than {} (dead-time)", step, deadTime)
                        : fmt::format("{} failed: {}", step, why);
  return {kj::Exception::Type::FAILED, __FILE__, __LINE__, kj::heapString(text)};
}

kj::Promise<kj::Own<kj::AsyncIoStream>> Dialer::connectToOne(Addresses addresses) {
  const auto next = addresses.front();
  addresses.erase(addresses.begin());
  const auto step = next == remote_.address.text() ? std::string("the connection")
                                                   : fmt::format("the connection to {}", next);
  return withTimeout(step, connectTo(next))
      .catch_([this, addresses = std::move(addresses)](
                  kj::Exception&& error) mutable -> kj::Promise<kj::Own<kj::AsyncIoStream>> {
        if (addresses.empty()) return kj::mv(error);
        return connectToOne(std::move(addresses));
      });
}

kj::Promise<kj::Own<kj::AsyncIoStream>> Dialer::connectTo(const std::string& address) {
  return context_.network.parseAddress(address).then([this](kj::Own<kj::NetworkAddress> parsed) {
    auto connected = parsed->connectAuthenticated();
    return connected.attach(kj::mv(parsed))
        .then([this](kj::AuthenticatedStream peer) -> kj::Promise<kj::Own<kj::AsyncIoStream>> {
          setSocketOptions(*peer.stream, context_.config.limits);
          if (remote_.security == Security::plain) return kj::mv(peer.stream);
          const auto& name = remote_.tlsName.empty() ? remote_.address.host : remote_.tlsName;
          return context_.tls->connect(kj::mv(peer), name)
              .then(
                  [](kj::AuthenticatedStream secured) -> kj::Promise<kj::Own<kj::AsyncIoStream>> {
                    return kj::mv(secured.stream);
                  },
                  [&name](kj::Exception&& error) -> kj::Promise<kj::Own<kj::AsyncIoStream>> {
                    return kj::Exception(kj::Exception::Type::FAILED, __FILE__, __LINE__,
                                         kj::heapString(tlsProblem(error, name)));
                  });
        });
  });
}

}  // namespace mpf::router
