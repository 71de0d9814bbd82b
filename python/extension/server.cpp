// SPDX-License-Identifier: MIT
#include "python/extension/server.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "python/extension/errors.h"
#include "python/extension/gil.h"
#include "python/extension/messages.h"
#include "python/extension/options.h"

namespace mpf::python {
namespace {

using nb::literals::operator""_a;

constexpr const char* kServer = "server";

class PyServer {
 public:
  PyServer(const std::string& name, std::optional<std::int32_t> location,
           const std::string& backplane, int queueSize, std::uint64_t maxMessageBytes,
           int maxBorrowed, const std::string& wait, std::uint32_t mode,
           std::optional<std::uint32_t> group)
      : name_(name), maxMessageBytes_(maxMessageBytes), forks_(forkCount()) {
    ServerOptions options{.queueSize = queueSize,
                          .maxMessageBytes = maxMessageBytes,
                          .waitMode = waitModeOf(wait),
                          .rights = {.mode = mode},
                          .stampsReplies = true,
                          .maxBorrowed = maxBorrowed};
    if (location) options.location = *location;
    if (group) options.rights.group = *group;
    server_ = std::make_shared<MessageServer>(Backplane::attach(backplane), name, options);
  }

  // Waits for the next request; None after `timeout` and after interrupt(). A request that has no
  // class is refused.
  nb::object receive(double timeout) {
    const auto server = opened();
    const auto deadline = deadlineOf(timeout);
    while (!isInterrupted_) {
      Message request = server->receive();
      if (!request) request = wait(*server, deadline);
      if (!request) break;
      if (auto object = tryRequestToPython(std::move(request)); object.is_valid()) return object;
      {  // such requests may come without end
        const nb::gil_scoped_release othersRun;
      }
      if (PyErr_CheckSignals() != 0) throw nb::python_error();
    }
    return nb::none();
  }
  // Returns false when the client has gone.
  bool reply(PyMessage& request, PyMessage& message) {
    const auto server = opened();
    checkRequest(request);
    auto sent = message.toMessage(Allocator(*server, request.handle));
    address(sent, request.handle);
    sent.setTimeStampNs(message.timeStampNs);
    const auto result = server->reply(std::move(sent));
    if (result == ReplyResult::sent) return true;
    if (result == ReplyResult::clientGone) return false;
    // NOLINTNEXTLINE(bugprone-use-after-move): a message that was not sent is unchanged
    message.restore(std::move(sent));
    raiseReply(name_, result);
  }
  // Returns, for each request, whether its client is connected.
  nb::list publish(PyMessage& message, const nb::list& requests) {
    const auto server = opened();
    std::vector<Message> addresses;
    for (const nb::handle one : requests) {
      const PyMessage* request = nullptr;
      if (!nb::try_cast(one, request) || request == nullptr) throw nb::type_error(kNoRequest);
      checkRequest(*request);
      // publish() uses only the route and the marks of the client, and a reply has them, too.
      addresses.push_back(server->allocReplyMessage<Int32>(request->handle));
    }
    auto shared = message.toMessage(Allocator(*server));
    shared.setTimeStampNs(message.timeStampNs);
    std::vector<ReplyResult> results(addresses.size());
    server->publish(shared, addresses, results);
    nb::list connected;
    for (const auto result : results) {
      if (result == ReplyResult::tooLarge) {
        message.restore(std::move(shared));
        raiseReply(name_, result);
      }
      connected.append(result != ReplyResult::clientGone);
    }
    return connected;
  }
  void refuse(PyMessage& request) {
    const auto server = opened();
    checkRequest(request);
    // Objects of Python may refer to the elements: `request` keeps them.
    Message refused;
    auto route = request.handle.route();
    refused.setRoute(route);
    route.keeper = nullptr;
    request.handle.setRoute(route);
    server->refuse(std::move(refused));
  }
  nb::object loan(PyMessage& request, nb::handle type, std::size_t length) {
    const auto server = opened();
    checkRequest(request);
    return python::loan(Allocator(*server, request.handle), type, length,
                        {name_, maxMessageBytes_});
  }
  nb::object loanShared(nb::handle type, std::size_t length) {
    const auto server = opened();
    return python::loan(Allocator(*server), type, length, {name_, maxMessageBytes_});
  }
  bool isClientConnected(const PyMessage& request) {
    const auto server = opened();
    checkRequest(request);
    return server->isClientConnected(request.handle);
  }
  void interrupt() {
    const auto server = opened();
    isInterrupted_ = true;
    server->interrupt();
  }
  [[nodiscard]] bool isInterrupted() const { return isInterrupted_; }
  // Whether interrupt() was called since the last call.
  bool takeInterrupt() {
    static_cast<void>(opened());
    return isInterrupted_.exchange(false);
  }
  int descriptor() { return opened()->descriptor(); }
  [[nodiscard]] const std::string& name() const { return name_; }
  std::int32_t location() { return opened()->location(); }
  void close() {
    if (!server_ || forks_ != forkCount()) return;
    interrupt();
    server_.reset();
  }

 private:
  static constexpr const char* kNoRequest = "not a request that this server received";
  static void checkRequest(const PyMessage& request) {
    if (request.handle.route().link == 0) throw nb::value_error(kNoRequest);
  }
  // `reply` may have been loaned for another request.
  static void address(Message& reply, const Message& request) {
    auto route = request.route();
    route.keeper = nullptr;
    reply.setRoute(route);
    reply.setClientType(request.getClientType());
    reply.setClientExtra(request.getClientExtra());
  }
  std::shared_ptr<MessageServer> opened() const {
    if (!server_) raiseClosed(kServer);
    if (forks_ != forkCount()) raiseInherited(kServer);
    return server_;
  }
  Message wait(MessageServer& server, Deadline deadline) {
    bool wasInterrupted = false;
    Message request;
    {
      WithoutGil unlocked;
      request = waitUnlocked(server, deadline, unlocked.interruption());
      wasInterrupted = unlocked.wasInterrupted();
    }
    if (wasInterrupted) throw nb::python_error();
    return request;
  }
  Message waitUnlocked(MessageServer& server, Deadline deadline,
                       const std::function<bool()>& hasSignal) {
    while (!deadline.hasPassed() && !isInterrupted_) {
      const auto look = Deadline::after(kLookForSignals);
      if (server.waitForMessage(std::min(deadline, look))) {
        if (auto request = server.receive()) return request;
      }
      if (look.hasPassed() && hasSignal()) break;
    }
    return {};
  }

  const std::string name_;
  const std::uint64_t maxMessageBytes_;
  const int forks_;
  std::shared_ptr<MessageServer> server_;  // null: closed
  std::atomic<bool> isInterrupted_ = false;
};

}  // namespace

void addServer(nb::module_& module) {
  nb::class_<PyServer>(module, "BaseServer", nb::is_weak_referenceable(),
                       "What mpf.Server is made of.")
      .def(nb::init<const std::string&, std::optional<std::int32_t>, const std::string&, int,
                    std::uint64_t, int, const std::string&, std::uint32_t,
                    std::optional<std::uint32_t>>(),
           "name"_a, "location"_a = nb::none(), nb::kw_only(), "backplane"_a = "",
           "queue_size"_a = 100, "max_message_bytes"_a = std::uint64_t{64} << 20,
           "max_borrowed"_a = 4, "wait"_a = "adaptive", "mode"_a = 0600, "group"_a = nb::none())
      .def("_receive", &PyServer::receive, "timeout"_a,
           nb::sig("def _receive(self, timeout: float) -> Message | None"))
      .def("_reply", &PyServer::reply, "request"_a, "message"_a)
      .def("refuse", &PyServer::refuse, "request"_a,
           "Ends the request without a reply: its client gets Refused.")
      .def("loan", &PyServer::loan, "request"_a, "type"_a, "length"_a,
           nb::sig("def loan(self, request: Message, type: type[_Array], length: int) -> _Array"),
           "As Client.loan(), for a reply to `request`.")
      .def("_publish", &PyServer::publish, "message"_a, "requests"_a,
           nb::sig("def _publish(self, message: Message, requests: list[Message]) -> list[bool]"))
      .def("loan_shared", &PyServer::loanShared, "type"_a, "length"_a,
           nb::sig("def loan_shared(self, type: type[_Array], length: int) -> _Array"),
           "As loan(), for publish(): in memory that all clients read.")
      .def("is_client_connected", &PyServer::isClientConnected, "request"_a,
           "Whether the client of `request` is connected and alive.")
      .def("interrupt", &PyServer::interrupt,
           "Ends the call of run() that is in progress, or else the next one. Any thread.")
      .def("_take_interrupt", &PyServer::takeInterrupt)
      .def_prop_ro("_is_interrupted", &PyServer::isInterrupted)
      .def("_fileno", &PyServer::descriptor)
      .def_prop_ro("name", &PyServer::name, "The name of the server.")
      .def_prop_ro("location", &PyServer::location, "The location of the server.")
      .def("_close", &PyServer::close);
}

}  // namespace mpf::python
