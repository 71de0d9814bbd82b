// SPDX-License-Identifier: MIT
// StartupSite: what the commands of a startup file have created so far.
//
// Threads  plain data, one thread.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "crate/config/crate.h"
#include "crate/startup/commands/boards.h"
#include "crate/startup/commands/ioc_file.h"
#include "crate/startup/commands/serial_lines.h"

namespace mpf::startup {

// The result of a command that creates a module, for later commands: pDAC = initDAC128V(...).
struct ModuleHandle {
  std::string name;
};

struct StartupSite {
  Boards boards;
  SerialLines serialLines;
  std::deque<crate::Process> modules;  // DAC128V, IP330, digital I/O, GPIB; references stay valid
  std::deque<crate::Process> routers;
  // Their needs are names of servers, because the names of processes may still change.
  std::deque<crate::Process> sniffers;
  IocFile ioc;
  std::optional<std::int32_t> location;  // localMessageRouterStart()
  // Replaces the addresses of routers in the file; empty: none.
  std::string address;

  // nullptr: no module of this kind has the name.
  [[nodiscard]] crate::Process* findModule(const std::string& kind, const std::string& name);
};

}  // namespace mpf::startup
