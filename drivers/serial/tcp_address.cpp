// SPDX-License-Identifier: MIT
#include <mpf/drivers/serial/tcp_address.h>

#include <cctype>
#include <cstdint>
#include <fmt/format.h>
#include <stdexcept>

#include "base/number.h"

namespace mpf {
namespace {

// The resolver takes numbers modulo 65536, and a sign before them.
bool isPort(std::string_view port) {
  constexpr std::string_view kDigits = "0123456789";
  if (port.find_first_not_of(kDigits) == std::string_view::npos)
    return tryNumber<std::uint16_t>(port).value_or(0) != 0;
  return std::isalnum(static_cast<unsigned char>(port.front())) != 0;
}

}  // namespace

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
  if (!isPort(port))
    throw std::invalid_argument(
        fmt::format(R"("{}" has no port from 1 to 65535, or name of a service, at its end)", text));
  return {std::string(host), std::string(port)};
}

std::string TcpAddress::toString() const {
  const bool isIpv6 = host.find(':') != std::string::npos;
  return isIpv6 ? fmt::format("[{}]:{}", host, port) : fmt::format("{}:{}", host, port);
}

}  // namespace mpf
