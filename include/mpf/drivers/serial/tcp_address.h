// SPDX-License-Identifier: MIT
// TcpAddress: a host and a port, written "host:port". An IPv6 address is written in brackets:
// "[::1]:4001".
#pragma once

#include <string>
#include <string_view>

namespace mpf {

struct TcpAddress {
  std::string host;  // a name or an address, without brackets
  std::string port;  // a number from 1 to 65535, or the name of a service

  // Splits `text` at its last colon. Does not look up the name.
  //   throws  std::invalid_argument when the host or the port is missing or the port is invalid, or
  //           an IPv6 address has no brackets
  [[nodiscard]] static TcpAddress parse(std::string_view text);
  // The same notation that parse() reads.
  [[nodiscard]] std::string toString() const;
  friend bool operator==(const TcpAddress&, const TcpAddress&) = default;
};

}  // namespace mpf
