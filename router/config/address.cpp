// SPDX-License-Identifier: MIT
#include <arpa/inet.h>
#include <netinet/in.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fmt/format.h>
#include <string_view>

#include "base/number.h"
#include "router/config/router_config.h"

namespace mpf::router {
namespace {

constexpr const char* kHowWritten =
    "write HOST:PORT, such as ioc1.lab:9900, 10.0.0.7:9900, [fd00::7]:9900 or, to listen, *:9900";
constexpr std::size_t kLongestName = 253;

[[noreturn]] void refuseAddress(const std::string& text, const std::string& why) {
  throw std::invalid_argument(fmt::format("\"{}\" {}; {}", text, why, kHowWritten));
}

bool mayBeInName(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
         c == '_';
}

bool isHostName(const std::string& host) {
  const bool hasEmptyLabel = host.starts_with('.') || host.find("..") != std::string::npos;
  return !host.empty() && host.size() <= kLongestName && !hasEmptyLabel &&
         std::ranges::all_of(host, [](char c) { return c == '.' || mayBeInName(c); });
}

// Returns the canonical text of an IPv6 address; empty when `host` is not an IPv6 address.
std::string canonicalIpv6(const std::string& host) {
  in6_addr address{};
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (::inet_pton(AF_INET6, host.c_str(), &address) != 1) return {};
  return ::inet_ntop(AF_INET6, &address, text.data(), text.size());
}

std::string checkedHost(const std::string& text, const std::string& host) {
  if (host.starts_with('[')) {
    auto canonical = canonicalIpv6(host.substr(1, host.size() - 2));
    if (!host.ends_with(']') || canonical.empty())
      refuseAddress(text, "has no valid IPv6 address in its brackets");
    return canonical;
  }
  if (host == "*") return host;
  if (host.find(':') != std::string::npos)
    refuseAddress(text, "is an IPv6 address without brackets, or has more than one port");
  in_addr address{};
  const bool isNumber = host.find_first_not_of("0123456789.") == std::string::npos;
  if (isNumber ? ::inet_pton(AF_INET, host.c_str(), &address) != 1 : !isHostName(host)) {
    refuseAddress(text, host.empty() ? "has no host before the port"
                                     : fmt::format("has an invalid host, \"{}\"", host));
  }
  return host;
}

std::uint16_t portOf(const std::string& text, std::string_view digits) {
  const auto port = tryNumber<std::uint16_t>(digits);
  if (!port) refuseAddress(text, "has no port from 0 to 65535 at its end");
  return *port;
}

struct Ipv4Network {
  std::uint32_t address;
  unsigned bits;
};
// Loopback, private (RFC 1918) and link-local networks.
constexpr std::array kNotPublic{Ipv4Network{0x7f00'0000, 8}, Ipv4Network{0x0a00'0000, 8},
                                Ipv4Network{0xac10'0000, 12}, Ipv4Network{0xc0a8'0000, 16},
                                Ipv4Network{0xa9fe'0000, 16}};

bool isPublicIpv4(std::uint32_t address) {
  return std::ranges::none_of(kNotPublic, [&](const Ipv4Network& one) {
    return (address ^ one.address) >> (32 - one.bits) == 0;
  });
}

bool isPublicIpv6(const in6_addr& address) {
  if (IN6_IS_ADDR_V4MAPPED(&address)) {
    std::uint32_t ipv4 = 0;
    std::memcpy(&ipv4, &address.s6_addr[12], sizeof(ipv4));
    return isPublicIpv4(ntohl(ipv4));
  }
  const bool isUniqueLocal = (address.s6_addr[0] & 0xfe) == 0xfc;
  return !IN6_IS_ADDR_LOOPBACK(&address) && !IN6_IS_ADDR_LINKLOCAL(&address) && !isUniqueLocal;
}

}  // namespace

std::string Address::text() const {
  const auto isIpv6 = host.find(':') != std::string::npos;
  return fmt::format("{}{}{}:{}", isIpv6 ? "[" : "", host, isIpv6 ? "]" : "", port);
}

Address parseAddress(const std::string& text) {
  const auto colon = text.rfind(':');
  if (colon == std::string::npos || text.ends_with(']')) refuseAddress(text, "has no port");
  return {checkedHost(text, text.substr(0, colon)),
          portOf(text, std::string_view(text).substr(colon + 1))};
}

bool isIpAddress(const std::string& host) {
  in6_addr room{};
  return ::inet_pton(AF_INET, host.c_str(), &room) == 1 ||
         ::inet_pton(AF_INET6, host.c_str(), &room) == 1;
}

bool isAny(const std::string& host) { return host == "*" || host == "0.0.0.0" || host == "::"; }

bool isPublic(const std::string& ip) {
  in_addr ipv4{};
  if (::inet_pton(AF_INET, ip.c_str(), &ipv4) == 1) return isPublicIpv4(ntohl(ipv4.s_addr));
  in6_addr ipv6{};
  return ::inet_pton(AF_INET6, ip.c_str(), &ipv6) != 1 || isPublicIpv6(ipv6);
}

}  // namespace mpf::router
