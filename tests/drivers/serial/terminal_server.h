// SPDX-License-Identifier: MIT
// TerminalServer: a port of a terminal server, simulated on a free TCP port of this host.
//
// Threads  one at a time.
#pragma once

#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <stdexcept>
#include <string>

#include <mpf/drivers/serial/tcp_address.h>
#include <mpf/file_descriptor.h>

#include "base/system_call.h"
#include "tests/support/watchdog.h"

namespace mpf::test {

class TerminalServer {
 public:
  explicit TerminalServer(int family = AF_INET) : family_(family), holder_(bind()) { switchOn(); }

  [[nodiscard]] TcpAddress address() const {
    return {family_ == AF_INET ? "127.0.0.1" : "::1", std::to_string(port_)};
  }
  [[nodiscard]] FileDescriptor accept() const {
    pollfd ready{listener_.get(), POLLIN, 0};
    const auto watchdogMs =
        static_cast<int>(std::chrono::milliseconds(Watchdog::kPatience).count());
    if (retryInterrupted([&] { return ::poll(&ready, 1, watchdogMs); }) != 1)
      throw std::runtime_error("accept: no connection within the time of the watchdog");
    return FileDescriptor(
        checkCall(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC), "accept"));
  }
  void switchOff() { listener_.reset(); }
  void switchOn() {
    listener_ = bind();
    checkCall(::listen(listener_.get(), 1), "listen");
  }

 private:
  // A socket at this port; the first chooses the port.
  FileDescriptor bind() {
    FileDescriptor made(checkCall(::socket(family_, SOCK_STREAM | SOCK_CLOEXEC, 0), "socket"));
    const int yes = 1;
    checkCall(::setsockopt(made.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes), "setsockopt");
    sockaddr_in6 address{};  // the port is at the same place in sockaddr_in
    address.sin6_family = static_cast<sa_family_t>(family_);
    address.sin6_port = htons(port_);
    socklen_t length = family_ == AF_INET ? sizeof(sockaddr_in) : sizeof(sockaddr_in6);
    auto* generic = reinterpret_cast<sockaddr*>(&address);
    checkCall(::bind(made.get(), generic, length), "bind");
    checkCall(::getsockname(made.get(), generic, &length), "getsockname");
    port_ = ntohs(address.sin6_port);
    return made;
  }
  const int family_;
  std::uint16_t port_ = 0;
  FileDescriptor holder_;  // never listens: other programs do not get the port meanwhile
  FileDescriptor listener_;
};

}  // namespace mpf::test
