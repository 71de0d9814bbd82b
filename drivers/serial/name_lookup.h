// SPDX-License-Identifier: MIT
// NameLookup: looks up a host name without blocking the caller. getaddrinfo() runs in a thread of
// its own, which may outlive this object.
//
//   NameLookup ──► Answer ◄── thread in getaddrinfo()     both own the answer
//
// Threads  one at a time.
// Trust    a name server that does not answer costs one thread until the resolver gives up.
#pragma once

#include <sys/socket.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <mpf/drivers/serial/tcp_address.h>

namespace mpf {

struct SocketAddress {
  sockaddr_storage storage{};
  socklen_t length = 0;
};

class NameLookup {
 public:
  struct Result {
    std::vector<SocketAddress> addresses;
    std::string problem;  // why there are no addresses; else empty
  };
  // Starts the lookup.
  //   throws  std::system_error when no descriptor or thread can be created
  explicit NameLookup(const TcpAddress& address);
  // For poll(): readable once the lookup has ended. Valid as long as this object.
  [[nodiscard]] int descriptor() const noexcept;
  // Returns the result, once; nullopt before the lookup has ended.
  [[nodiscard]] std::optional<Result> tryTake();

 private:
  struct Answer;
  std::shared_ptr<Answer> answer_;
};

}  // namespace mpf
