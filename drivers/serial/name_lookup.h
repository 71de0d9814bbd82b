// SPDX-License-Identifier: MIT
// NameLookup: getaddrinfo() that keeps nobody waiting: it runs in a thread of its own, which may
// outlive this object.
//
//   NameLookup ──► answer ◄── thread in getaddrinfo()        both hold the answer; the descriptor becomes readable
//
// Threads  one caller.
// Trust    a name server that does not answer costs a thread until the resolver gives up.
#pragma once

#include <sys/socket.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/serial/tcp_address.h"

namespace mpf {

struct SocketAddress {
  sockaddr_storage storage{};
  socklen_t length = 0;
};

class NameLookup {
 public:
  struct Result {
    std::vector<SocketAddress> addresses;
    std::string problem;  // when there are none
  };
  explicit NameLookup(const TcpAddress& address);
  // Readable once there is a result.
  [[nodiscard]] int descriptor() const noexcept;
  [[nodiscard]] std::optional<Result> tryTake();

 private:
  struct Answer;
  std::shared_ptr<Answer> answer_;
};

}  // namespace mpf
