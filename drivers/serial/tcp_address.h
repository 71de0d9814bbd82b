// SPDX-License-Identifier: MIT
// TcpAddress: "host:port" as people write it; IPv6 addresses stand in brackets: "[::1]:4001".
#pragma once

#include <string>
#include <string_view>

namespace mpf {

struct TcpAddress {
  std::string host;
  std::string port;  // a number or a service name

  // Throws std::invalid_argument.
  [[nodiscard]] static TcpAddress parse(std::string_view text);
  [[nodiscard]] std::string toString() const;
  friend bool operator==(const TcpAddress&, const TcpAddress&) = default;
};

}  // namespace mpf
