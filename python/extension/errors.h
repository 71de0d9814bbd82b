// SPDX-License-Identifier: MIT
// Raises the exceptions of mpf/errors.py.
#pragma once

#include <nanobind/nanobind.h>
#include <string>

#include <mpf/message_client.h>
#include <mpf/message_server.h>

namespace mpf::python {

namespace nb = nanobind;

// All throw nb::python_error. `server` is the name that the text begins with.
[[noreturn]] void raiseNotSent(const std::string& server, SendResult result,
                               const std::string& details);
//   what  was refused
[[noreturn]] void raiseTooLarge(const std::string& server, const char* what, std::uint64_t bytes,
                                std::uint64_t limit);
[[noreturn]] void raiseFate(const std::string& server, Fate fate);
// The deadline of the caller passed after the server had taken the request.
[[noreturn]] void raiseTimedOut(const std::string& server);
[[noreturn]] void raiseClosed(const char* object);
// After fork(), in the child.
[[noreturn]] void raiseInherited(const char* object);
// Translates NameInUse, SegmentError and std::system_error. Adds the translator of the module.
void addErrors();
// A reply of a server that was not sent.
[[noreturn]] void raiseReply(const std::string& server, ReplyResult result);
// A reply with a status other than 0.
[[noreturn]] void raiseStatus(const std::string& server, nb::object reply);
// A reply of another type than the caller expects.
[[noreturn]] void raiseUnexpected(const std::string& server, nb::object reply);

}  // namespace mpf::python
