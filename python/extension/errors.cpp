// SPDX-License-Identifier: MIT
#include "python/extension/errors.h"

#include <exception>
#include <system_error>
#include <utility>

#include <mpf/errors.h>

#include "python/extension/gil.h"

namespace mpf::python {
namespace {

nb::object classOf(const char* name) { return nb::module_::import_("mpf.errors").attr(name); }

template <class... Argument>
[[noreturn]] void raise(const char* name, Argument&&... arguments) {
  const CallsPython guard;
  const auto type = classOf(name);
  const nb::object error = type(std::forward<Argument>(arguments)...);
  PyErr_SetObject(type.ptr(), error.ptr());
  throw nb::python_error();
}

const char* nameOf(SendResult result) {
  switch (result) {
    case SendResult::notConnected:
      return "NotConnected";
    case SendResult::queueFull:
    case SendResult::tooManyOutstanding:
      return "QueueFull";
    case SendResult::tooLarge:
      return "TooLarge";
    default:
      return "NotSent";
  }
}

struct Ending {
  const char* name;
  const char* text;
};

Ending endingOf(Fate fate) {
  switch (fate) {
    case Fate::refused:
      return {"Refused",
              "refused: the server has no handler for messages of this class, or dropped the "
              "request"};
    case Fate::neverTaken:
      return {"NeverTaken",
              "the connection ended before the server took the request: nothing was done"};
    case Fate::expired:
      return {"Expired", "the server did not take the request in time: nothing was done"};
    case Fate::cancelled:
      return {"Cancelled", "the request was cancelled"};
    default:
      return {
          "OutcomeUnknown",
          "the connection ended without a reply: the server may have taken the request, and may "
          "have carried it out"};
  }
}

nb::str sentence(const std::string& server, const std::string& text) {
  const auto line = server + ": " + text;
  return nb::str(line.c_str(), line.size());
}

void translate(const std::exception_ptr& error, void* /*payload*/) {
  const CallsPython guard;
  try {
    std::rethrow_exception(error);
  } catch (const std::system_error& failure) {
    const nb::object arguments = nb::make_tuple(failure.code().value(), failure.what());
    PyErr_SetObject(PyExc_OSError, arguments.ptr());
  } catch (const NameInUse& failure) {
    PyErr_SetString(classOf("NameInUse").ptr(), failure.what());
  } catch (const SegmentError& failure) {
    PyErr_SetString(classOf("Error").ptr(), failure.what());
  }
}

}  // namespace

void addErrors() { nb::register_exception_translator(translate); }

void raiseNotSent(const std::string& server, SendResult result, const std::string& details) {
  auto text = std::string("not sent: ") + toString(result);
  if (!details.empty()) text += ": " + details;
  raise(nameOf(result), sentence(server, text));
}

void raiseTooLarge(const std::string& server, const char* what, std::uint64_t bytes,
                   std::uint64_t limit) {
  raise(nameOf(SendResult::tooLarge),
        sentence(server, std::string(what) + ": " + toString(SendResult::tooLarge) + ": " +
                             std::to_string(bytes) + " bytes, the limit is " +
                             std::to_string(limit)));
}

void raiseFate(const std::string& server, Fate fate) {
  const auto ending = endingOf(fate);
  raise(ending.name, sentence(server, ending.text));
}

void raiseTimedOut(const std::string& server) {
  raise("TimedOut", sentence(server,
                             "no reply in time: the server took the request, and may "
                             "have acted on it"));
}

void raiseClosed(const char* object) {
  raise("Error", nb::str((std::string("the ") + object + " is closed").c_str()));
}

void raiseInherited(const char* object) {
  PyErr_Format(PyExc_RuntimeError, "the %s belongs to the parent process: create one after fork()",
               object);
  throw nb::python_error();
}

void raiseReply(const std::string& server, ReplyResult result) {
  const char* name = result == ReplyResult::queueFull  ? "QueueFull"
                     : result == ReplyResult::tooLarge ? "TooLarge"
                                                       : "NotSent";
  raise(name, sentence(server, std::string("reply not sent: ") + toString(result)));
}

void raiseUnexpected(const std::string& server, nb::object reply) {
  raise("UnexpectedReply", nb::str(server.c_str(), server.size()), std::move(reply));
}

void raiseStatus(const std::string& server, nb::object reply) {
  raise("StatusError", nb::str(server.c_str(), server.size()), std::move(reply));
}

}  // namespace mpf::python
