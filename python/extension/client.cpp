// SPDX-License-Identifier: MIT
#include "python/extension/client.h"

#include <cmath>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>
#include <optional>
#include <utility>

#include "python/extension/errors.h"
#include "python/extension/gil.h"
#include "python/extension/options.h"

namespace mpf::python {
namespace {

using nb::literals::operator""_a;

Retry retryOf(bool retry) { return retry ? Retry::neverTaken : Retry::never; }

nb::object checked(const std::string& server, nb::object reply, const Expected& expected) {
  if (!expected.check) return reply;
  if (nb::cast<PyMessage&>(reply).status() != 0) raiseStatus(server, std::move(reply));
  if (!reply.type().is(expected.type) && !expected.type.is(nb::type<PyMessage>()))
    raiseUnexpected(server, std::move(reply));
  return reply;
}

// The type of the reply to a request of type `request`, unless the caller names another.
nb::object expectedType(nb::handle request, nb::object wanted) {
  if (!wanted.is_none()) return wanted;
  const auto type = request.type();
  return nb::borrow(type.is(nb::type<PyScalar<SerialConfig>>()) ? nb::type<PyScalar<Int32>>()
                                                                : type);
}

}  // namespace

// ---- PyRequest

PyRequest::PyRequest(std::shared_ptr<Connection> connection, Deadline deadline, nb::object type,
                     std::size_t limit)
    : connection_(std::move(connection)), deadline_(deadline), type_(std::move(type)) {
  exchange_.limit = limit;
}

PyRequest::~PyRequest() { close(); }

void PyRequest::send(PyMessage& message, Retry retry, bool waits) {
  connection_->send(message, exchange_, deadline_, connectBefore(waits), retry);
}

std::size_t PyRequest::sendMany(std::span<PyMessage* const> messages,
                                std::span<const std::shared_ptr<PyRequest>> requests, bool waits) {
  if (requests.empty()) return 0;
  std::vector<Exchange*> exchanges;
  for (const auto& request : requests) exchanges.push_back(&request->exchange_);
  const auto& first = *requests.front();
  return first.connection_->sendMany(messages, exchanges, first.deadline_,
                                     first.connectBefore(waits));
}

nb::object PyRequest::wait(bool check) {
  bool wasInterrupted = false;
  if (!hasEnded()) {
    const auto requester = connection_->requester();
    WithoutGil unlocked;
    requester->waitForEnd(exchange_, deadline_, unlocked.interruption());
    wasInterrupted = unlocked.wasInterrupted();
  }
  if (wasInterrupted) throw nb::python_error();
  return finish(check);
}

nb::object PyRequest::result(bool check) { return hasEnded() ? finish(check) : nb::none(); }

// Asks the requester: another thread may write the exchange now.
bool PyRequest::hasEnded() const {
  return connection_->isClosed() || connection_->requester()->hasEnded(exchange_);
}

// The exchange has ended.
nb::object PyRequest::finish(bool check) {
  if (exchange_.reply)
    reply_ = toPython(connection_->isClosed() ? std::move(exchange_.reply)
                                              : connection_->requester()->takeReply(exchange_));
  if (reply_.is_valid()) return checked(connection_->server, reply_, {type_, check});
  if (deadline_.hasPassed() && exchange_.fate == Fate::outcomeUnknown)
    raiseTimedOut(connection_->server);
  raiseFate(connection_->server, exchange_.fate.value_or(Fate::outcomeUnknown));
}

nb::object PyRequest::next(double timeout) {
  Message message;
  bool wasInterrupted = false;
  {
    const auto requester = connection_->requester();
    WithoutGil unlocked;
    message = requester->waitForFurther(exchange_, deadlineOf(timeout), unlocked.interruption());
    wasInterrupted = unlocked.wasInterrupted();
  }
  if (wasInterrupted) throw nb::python_error();
  return message ? toPython(std::move(message)) : nb::none();
}

nb::object PyRequest::takeNext() {
  auto message = connection_->requester()->takeFurther(exchange_);
  return message ? toPython(std::move(message)) : nb::none();
}

std::uint64_t PyRequest::missed() const {
  return connection_->isClosed() ? exchange_.missed : connection_->requester()->missed(exchange_);
}

bool PyRequest::isConnected() const {
  return !connection_->isClosed() && !connection_->requester()->isDisconnected(exchange_);
}

void PyRequest::cancel() { connection_->requester()->cancel(exchange_); }

void PyRequest::close() {
  if (connection_->isClosed() || connection_->isInherited()) return;
  const auto requester = connection_->requester();
  if (exchange_.id != 0 && !requester->hasEnded(exchange_)) requester->cancel(exchange_);
  requester->forget(exchange_);
}

// ---- PyClient

namespace {

class PyClient {
 public:
  PyClient(std::string server, std::optional<std::int32_t> location, const std::string& backplane,
           double timeout, const std::string& wait)
      : location_(location.value_or(Backplane::defaultLocation())),
        timeout_(timeout),
        connection_(std::make_shared<Connection>(backplane, std::move(server), location_,
                                                 waitModeOf(wait))) {}

  nb::object call(nb::handle message, std::optional<double> timeout, nb::object reply, bool retry,
                  bool check) {
    PyRequest request(connection_, deadline(timeout), expectedType(message, std::move(reply)), 0);
    request.send(messageOf(message), retryOf(retry), true);
    return request.wait(check);
  }
  std::shared_ptr<PyRequest> send(nb::handle message, std::optional<double> timeout,
                                  nb::object reply, bool retry, std::size_t further, bool waits) {
    auto request = std::make_shared<PyRequest>(connection_, deadline(timeout),
                                               expectedType(message, std::move(reply)), further);
    request->send(messageOf(message), retryOf(retry), waits);
    return request;
  }
  // `messages` is a list that nobody else changes.
  std::vector<std::shared_ptr<PyRequest>> sendMany(const nb::list& messages,
                                                   std::optional<double> timeout,
                                                   const nb::object& reply, std::size_t further,
                                                   bool waits) {
    const auto end = deadline(timeout);
    std::vector<PyMessage*> objects;
    std::vector<std::shared_ptr<PyRequest>> requests;
    for (const nb::handle message : messages) {
      objects.push_back(&messageOf(message));
      requests.push_back(
          std::make_shared<PyRequest>(connection_, end, expectedType(message, reply), further));
    }
    requests.resize(PyRequest::sendMany(objects, requests, waits));
    return requests;
  }
  bool waitConnected(std::optional<double> timeout) {
    bool isConnected = false;
    bool wasInterrupted = false;
    {
      const auto requester = connection_->requester();
      WithoutGil unlocked;
      isConnected = requester->connect(deadline(timeout), unlocked.interruption());
      wasInterrupted = unlocked.wasInterrupted();
    }
    if (wasInterrupted) throw nb::python_error();
    return isConnected;
  }
  nb::object loan(nb::handle type, std::size_t length) {
    const auto requester = connection_->requester();
    auto& client = requester->client();
    return python::loan(Allocator(client), type, length,
                        {connection_->server, client.maxMessageBytes()});
  }
  std::vector<std::uint32_t> runPending() {
    const auto requester = connection_->requester();
    const WithoutGil unlocked;
    return requester->runPending();
  }
  // [s] from now; None without one.
  std::optional<double> nextDeadline() {
    const auto next = connection_->requester()->nextDeadline();
    if (next.isNever()) return std::nullopt;
    return std::chrono::duration<double>(next.left()).count();
  }
  int descriptor() { return connection_->requester()->descriptor(); }
  bool isConnected() { return connection_->requester()->client().isConnected(); }
  std::string notConnectedBecause() {
    return connection_->requester()->client().notConnectedBecause();
  }
  std::uint64_t maxMessageBytes() { return connection_->requester()->client().maxMessageBytes(); }
  [[nodiscard]] const std::string& server() const { return connection_->server; }
  [[nodiscard]] std::int32_t location() const { return location_; }
  [[nodiscard]] double timeout() const { return timeout_; }
  void close() { connection_->close(); }

 private:
  static PyMessage& messageOf(nb::handle message) {
    PyMessage* result = nullptr;
    if (!nb::try_cast(message, result) || result == nullptr)
      throw nb::type_error("the request must be a message, for example mpf.Int32(value=3)");
    return *result;
  }
  Deadline deadline(std::optional<double> timeout) const {
    return deadlineOf(timeout.value_or(timeout_));
  }

  const std::int32_t location_;
  const double timeout_;
  const std::shared_ptr<Connection> connection_;
};

constexpr const char* kCallText =
    R"(Sends a request and waits for its reply.

message: the request. It can be sent again; a loaned array is empty then.
timeout: [s] for the connection, the request and the reply together; None: that of the client.
reply: the class of the reply, mpf.Message for any; by default that of the request, and Int32 for a
    SerialConfig.
retry: if the server ends before it has taken the request, send it to the next server with this
    name. This never executes a request twice.
check: raise StatusError if the status of the reply is not 0, and UnexpectedReply if it is of
    another class. False: return any reply.

Raises NotConnected, QueueFull or TooLarge if the request was not sent; NeverTaken or Expired if the
server has not taken it; TimedOut, OutcomeUnknown or Refused otherwise.)";

void addRequest(nb::module_& module) {
  nb::class_<PyRequest>(module, "Request", "A request that was sent: Client.send() returns it.")
      .def("wait", &PyRequest::wait, nb::kw_only(), "check"_a = true,
           nb::sig("def wait(self, *, check: bool = True) -> Message"),
           "Waits for the reply, at most until the time limit of send().\n\n"
           "check: raise StatusError if the status of the reply is not 0.")
      .def("result", &PyRequest::result, nb::kw_only(), "check"_a = true,
           nb::sig("def result(self, *, check: bool = True) -> Message | None"),
           "As wait(), without waiting: None while the request has not ended.")
      .def("next", &PyRequest::next, "timeout"_a,
           nb::sig("def next(self, timeout: float) -> Message | None"),
           "Waits [s] for a further reply. None after that time, and when the connection has "
           "ended.")
      .def("take_next", &PyRequest::takeNext, nb::sig("def take_next(self) -> Message | None"),
           "As next(), without waiting.")
      .def("cancel", &PyRequest::cancel,
           "Ends the request as Cancelled, unless it has ended. The server may act on it.")
      .def("close", &PyRequest::close, "Cancels the request, and drops further replies.")
      .def_prop_ro("id", &PyRequest::id, "The number of the request in its client.")
      .def_prop_ro("missed", &PyRequest::missed,
                   "The number of further replies that were dropped because the program did not "
                   "take the earlier ones.")
      .def_prop_ro("connected", &PyRequest::isConnected,
                   "False when the connection of the request has ended: no further reply will "
                   "come.");
}

}  // namespace

void addClient(nb::module_& module) {
  addRequest(module);
  nb::class_<PyClient>(module, "BaseClient", nb::is_weak_referenceable(),
                       "What mpf.Client and mpf.AsyncClient have in common.")
      .def(nb::init<std::string, std::optional<std::int32_t>, const std::string&, double,
                    const std::string&>(),
           "server"_a, "location"_a = nb::none(), nb::kw_only(), "backplane"_a = "",
           "timeout"_a = 5.0, "wait"_a = "adaptive")
      .def("call", &PyClient::call, "message"_a, "timeout"_a = nb::none(), nb::kw_only(),
           "reply"_a = nb::none(), "retry"_a = false, "check"_a = true,
           nb::sig("def call(self, message: Message, timeout: float | None = None, *, reply: "
                   "type[Message] | None = None, retry: bool = False, check: bool = True) -> "
                   "Message"),
           kCallText)
      .def("_send", &PyClient::send, "message"_a, "timeout"_a = nb::none(), nb::kw_only(),
           "reply"_a = nb::none(), "retry"_a = false, "further"_a = 0, "waits"_a = true,
           nb::sig("def _send(self, message: Message, timeout: float | None = None, *, reply: "
                   "type[Message] | None = None, retry: bool = False, further: int = 0, waits: "
                   "bool = True) -> Request"))
      .def("_send_many", &PyClient::sendMany, "messages"_a, "timeout"_a = nb::none(), nb::kw_only(),
           "reply"_a = nb::none(), "further"_a = 0, "waits"_a = true,
           nb::sig("def _send_many(self, messages: list[Message], timeout: float | None = None, *, "
                   "reply: type[Message] | None = None, further: int = 0, waits: bool = True) -> "
                   "list[Request]"))
      .def("_wait_connected", &PyClient::waitConnected, "timeout"_a = nb::none())
      .def("loan", &PyClient::loan, "type"_a, "length"_a,
           nb::sig("def loan(self, type: type[_Array], length: int) -> _Array"),
           "Returns an array message of `length` elements in the memory that is shared with the "
           "server, for the program to fill in; its elements are not initialised. Sending it "
           "copies nothing, unless an array of numpy still refers to it.\n\n"
           "Without a connection, or when the shared memory is full, it is ordinary memory. Raises "
           "TooLarge if the server, once it is connected, does not accept so large a message.")
      .def("_run_pending", &PyClient::runPending)
      .def("_next_deadline", &PyClient::nextDeadline)
      .def("_fileno", &PyClient::descriptor)
      .def_prop_ro("connected", &PyClient::isConnected, "Whether the client is connected.")
      .def_prop_ro("why_not_connected", &PyClient::notConnectedBecause,
                   "The reason in words; empty when the client is connected.")
      .def_prop_ro("max_message_bytes", &PyClient::maxMessageBytes,
                   "[bytes] The largest message that the server accepts; 0 without a connection.")
      .def_prop_ro("server", &PyClient::server, "The name of the server.")
      .def_prop_ro("location", &PyClient::location, "The location of the server.")
      .def_prop_ro("timeout", &PyClient::timeout, "[s] The time limit of calls without their own.")
      .def("_close", &PyClient::close);
}

}  // namespace mpf::python
