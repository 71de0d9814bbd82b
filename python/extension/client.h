// SPDX-License-Identifier: MIT
// PyClient, PyRequest: the classes behind mpf.Client, mpf.AsyncClient and mpf.Request.
//
// Threads  any; a call that waits releases the GIL.
// Fork     objects of the parent raise an exception in the child.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "python/extension/connection.h"
#include "python/extension/messages.h"
#include "python/extension/requester.h"

namespace mpf::python {

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
  // Sends messages[i] as requests[i]. Returns how many were sent; the other requests are not used.
  //   requests  of one connection, with one deadline
  static std::size_t sendMany(std::span<PyMessage* const> messages,
                              std::span<const std::shared_ptr<PyRequest>> requests, bool waits);
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
  [[nodiscard]] bool hasEnded() const;
  nb::object finish(bool check);
  // Until when sending waits for the connection.
  [[nodiscard]] Deadline connectBefore(bool waits) const noexcept {
    return waits ? deadline_ : Deadline::atNs(0);
  }

  const std::shared_ptr<Connection> connection_;
  Deadline deadline_;
  nb::object type_;
  Exchange exchange_;
  nb::object reply_;  // once it was asked for
};

void addClient(nb::module_& module);

}  // namespace mpf::python
