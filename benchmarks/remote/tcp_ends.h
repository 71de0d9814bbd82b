// SPDX-License-Identifier: MIT
// The two ends of a TCP connection between the sides of a row, with TCP_NODELAY.
//
// Each connection makes the process ignore SIGPIPE.
//   throws  std::system_error
#pragma once

#include <cstdint>
#include <string>

#include <mpf/file_descriptor.h>

namespace mpf::bench {

// A listener on a free port of an IPv4 address.
class TcpListener {
 public:
  explicit TcpListener(const std::string& address);
  [[nodiscard]] std::uint16_t port() const noexcept { return port_; }
  // Waits for a connection.
  [[nodiscard]] FileDescriptor accept() const;

 private:
  FileDescriptor fd_;
  std::uint16_t port_ = 0;
};

[[nodiscard]] FileDescriptor connectTcp(const std::string& address, std::uint16_t port);

}  // namespace mpf::bench
