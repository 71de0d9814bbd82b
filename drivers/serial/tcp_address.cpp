// SPDX-License-Identifier: MIT
#include <mpf/drivers/serial/tcp_address.h>

#include <fmt/format.h>
#include <stdexcept>

namespace mpf {

TcpAddress TcpAddress::parse(std::string_view text) {
  const auto fail = [&]() -> TcpAddress {
    throw std::invalid_argument(
        fmt::format(R"("{}" is not a TCP address: write host:port or [IPv6 address]:port)", text));
  };
  const auto colon = text.rfind(':');
  if (colon == std::string_view::npos || colon == 0 || colon + 1 == text.size()) return fail();
  auto host = text.substr(0, colon);
  const auto port = text.substr(colon + 1);
  const bool inBrackets = host.starts_with('[') && host.ends_with(']');
  if (inBrackets) host = host.substr(1, host.size() - 2);
  if (host.empty() || (!inBrackets && host.find(':') != std::string_view::npos)) return fail();
  return {std::string(host), std::string(port)};
}

std::string TcpAddress::toString() const {
  const bool isIpv6 = host.find(':') != std::string::npos;
  return isIpv6 ? fmt::format("[{}]:{}", host, port) : fmt::format("{}:{}", host, port);
}

}  // namespace mpf
