// SPDX-License-Identifier: MIT
// Connection: the connection that a client of Python and its requests share.
//
// Threads  any, with the GIL; a call that waits releases it.
// Fork     a connection of the parent raises an exception in the child.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "python/extension/messages.h"
#include "python/extension/requester.h"

namespace mpf::python {

struct Connection {
  Connection(const std::string& backplane, std::string serverName, std::int32_t location,
             WaitMode waitMode);
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  [[nodiscard]] bool isInherited() const noexcept;
  [[nodiscard]] bool isClosed() const noexcept { return !requester_; }
  // Calls in progress end as Requester::close() says; later ones throw.
  void close();
  // The requester, for one call. Throws nb::python_error when it is closed, and in a child process.
  [[nodiscard]] std::shared_ptr<Requester> requester() const;
  // Sends `message`; waits for the connection until `connectBefore`.
  //   throws  nb::python_error: NotSent, and what a signal handler raised
  void send(PyMessage& message, Exchange& exchange, Deadline deadline, Deadline connectBefore,
            Retry retry);
  // The same for several messages, in order, until one is not sent. Returns how many were sent.
  //   throws  as send(), when none was sent; all messages are unchanged then
  std::size_t sendMany(std::span<PyMessage* const> messages, std::span<Exchange* const> exchanges,
                       Deadline deadline, Deadline connectBefore);

  const std::string server;

 private:
  // Throws the reason why a message of `bytes` was not sent. Returns when the client has lost its
  // connection and may wait for the next one.
  void raiseUnlessLost(MessageClient& client, SendResult result, std::size_t bytes,
                       Deadline connectBefore) const;
  static void connect(Requester& requester, Deadline deadline);
  template <class Attempt>
  static SendResult sendWithRoom(Requester& requester, const Attempt& attempt);
  const int forks_;  // of this process, when it was made
  // Null: closed. The GIL guards it; the last call that uses the requester destroys it.
  std::shared_ptr<Requester> requester_;
};

}  // namespace mpf::python
