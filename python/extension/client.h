// SPDX-License-Identifier: MIT
// PyClient, PyRequest: the classes behind mpf.Client, mpf.AsyncClient and mpf.Request.
//
// Threads  any; a call that waits releases the GIL.
// Fork     objects of the parent raise an exception in the child.
#pragma once

#include <memory>
#include <string>

#include "python/extension/gil.h"
#include "python/extension/messages.h"
#include "python/extension/requester.h"

namespace mpf::python {

// The connection that a client and its requests share.
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

  const std::string server;

 private:
  static void connect(Requester& requester, Deadline deadline);
  const int forks_;  // of this process, when it was made
  // Null: closed. The GIL guards it; the last call that uses the requester destroys it.
  std::shared_ptr<Requester> requester_;
};

// What a caller accepts as the reply.
struct Expected {
  nb::handle type;  // a class of messages; mpf.Message: any
  bool check;  // a reply with a status other than 0 is an error; if not, replies have any type
};

// A request that was sent.
class PyRequest {
 public:
  //   type   of the reply, see Expected; a new reference
  //   limit  of further replies, see Exchange
  PyRequest(std::shared_ptr<Connection> connection, Deadline deadline, nb::object type,
            std::size_t limit);
  ~PyRequest();
  PyRequest(const PyRequest&) = delete;
  PyRequest& operator=(const PyRequest&) = delete;

  void send(PyMessage& message, Retry retry, bool waits);
  // Waits for the reply, the same object at each call.
  nb::object wait(bool check);
  // The same without waiting; None while the request has not ended.
  nb::object result(bool check);
  // The next further reply; None after the deadline, and when the connection has ended.
  nb::object next(double timeout);
  nb::object takeNext();
  void cancel();
  void close();
  [[nodiscard]] std::uint32_t id() const noexcept { return exchange_.id; }
  [[nodiscard]] std::uint64_t missed() const;
  [[nodiscard]] bool isConnected() const;

 private:
  nb::object finish(bool check);

  const std::shared_ptr<Connection> connection_;
  Deadline deadline_;
  nb::object type_;
  Exchange exchange_;
  nb::object reply_;  // once it was asked for
};

void addClient(nb::module_& module);

}  // namespace mpf::python
