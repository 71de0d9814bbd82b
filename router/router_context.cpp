// SPDX-License-Identifier: MIT
#include "router/router_context.h"

#include <netinet/in.h>
#include <netinet/tcp.h>

#include <algorithm>
#include <fmt/format.h>
#include <sstream>

#include "base/version.h"
#include "router/transport/peer_greeting.h"

namespace mpf::router {

std::string hostForKj(const Address& address) {
  return address.host.find(':') == std::string::npos ? address.host
                                                     : fmt::format("[{}]", address.host);
}

void setSocketOptions(kj::AsyncIoStream& stream, const Limits& limits) {
  // When a peer has not acknowledged or read any data for this time, it has received no sign of
  // life of ours, either.
  const auto timeoutMs = static_cast<unsigned>(2 * limits.deadTime.count());
  stream.setsockopt(IPPROTO_TCP, TCP_USER_TIMEOUT, &timeoutMs, sizeof timeoutMs);
  const int on = 1;
  stream.setsockopt(IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
}

void checkPlain(kj::NetworkAddress& address, const RouterConfig& config) {
  if (config.allowPublicPlain) return;
  const auto text = address.toString();
  std::istringstream each(std::string(text.begin(), text.size()));
  for (std::string one; std::getline(each, one, ',');) {
    const auto parsed = parseAddress(one);
    if (isPublic(parsed.host)) {
      throw std::runtime_error(
          fmt::format("{} is a public address: use TLS, or write allow-public-plain = true", one));
    }
  }
}

void fillGreeting(wire::Greeting::Builder greeting, const RouterContext& context) {
  fillLimits(greeting, context.config.limits);
  greeting.setRouter(context.config.name);
  greeting.setProgram(fmt::format("mpf-router {}", kVersion));
  greeting.setIncarnation(context.incarnation);
}

}  // namespace mpf::router
