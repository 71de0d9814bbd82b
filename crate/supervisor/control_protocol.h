// SPDX-License-Identifier: MIT
// ControlProtocol: what mpf ps, mpf stop, ... say to the supervisor of a crate, over its socket.
// One JSON object on a line for a request, one for its reply, then the connection is closed.
//
//   {"do": "ps"}                        {"processes": [{"name", "state", "pid", ...}], ...}
//   {"do": "restart", "name": "dac"}    {} or {"error": "..."}
//   {"do": "reload"}                    {"changed": [NAMES]}, {"error": "..."}, or
//                                       {"fileErrors": "..."}: the text of a ConfigError
//   also "start", "stop", and "shutdown" for the whole crate
//
// Threads  one.
// Trust    only the user of the supervisor can connect; a request that is no JSON gets an error.
#pragma once

#include <chrono>
#include <nlohmann/json.hpp>
#include <string>

#include <mpf/file_descriptor.h>

#include "crate/supervisor/crate_folder.h"

namespace mpf::crate {

// Longest request; a reply may have any length.
inline constexpr std::size_t kMaxRequestBytes = 65536;

// The listening socket of a supervisor.
//   throws  std::system_error
[[nodiscard]] FileDescriptor listenForControl(const CrateFolder& folder);

// Sends a request to the supervisor and returns its reply.
//   throws  std::runtime_error when no supervisor runs, when it is stopped, when it does not reply
//           within `patience`, or with the error that it replied; ConfigError when the crate file
//           has errors
nlohmann::json askSupervisor(const CrateFolder& folder, const nlohmann::json& request,
                             std::chrono::milliseconds patience = std::chrono::seconds(30));

}  // namespace mpf::crate
