// SPDX-License-Identifier: MIT
#include "benchmarks/remote/tcp_ends.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <signal.h>
#include <sys/socket.h>

#include <utility>

#include "base/system_call.h"

namespace mpf::bench {
namespace {

FileDescriptor newSocket() {
  return FileDescriptor(checkCall(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0), "socket"));
}

sockaddr_in socketAddress(const std::string& address, std::uint16_t port) {
  sockaddr_in made{};
  made.sin_family = AF_INET;
  made.sin_port = htons(port);
  ::inet_pton(AF_INET, address.c_str(), &made.sin_addr);
  return made;
}

FileDescriptor prepared(FileDescriptor connection) {
  ::signal(SIGPIPE, SIG_IGN);  // NOLINT(cert-err33-c): cannot fail
  const int on = 1;
  checkCall(::setsockopt(connection.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on), "setsockopt",
            "TCP_NODELAY");
  return connection;
}

}  // namespace

TcpListener::TcpListener(const std::string& address) : fd_(newSocket()) {
  auto bound = socketAddress(address, 0);
  socklen_t length = sizeof bound;
  checkCall(::bind(fd_.get(), reinterpret_cast<const sockaddr*>(&bound), length), "bind", address);
  checkCall(::listen(fd_.get(), 1), "listen");
  checkCall(::getsockname(fd_.get(), reinterpret_cast<sockaddr*>(&bound), &length), "getsockname");
  port_ = ntohs(bound.sin_port);
}

FileDescriptor TcpListener::accept() const {
  return prepared(FileDescriptor(checkCall(::accept(fd_.get(), nullptr, nullptr), "accept")));
}

FileDescriptor connectTcp(const std::string& address, std::uint16_t port) {
  auto connection = newSocket();
  const auto peer = socketAddress(address, port);
  checkCall(::connect(connection.get(), reinterpret_cast<const sockaddr*>(&peer), sizeof peer),
            "connect", address);
  return prepared(std::move(connection));
}

}  // namespace mpf::bench
