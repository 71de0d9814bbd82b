// SPDX-License-Identifier: MIT
#include "crate/supervisor/crate_state.h"

#include <nlohmann/json.hpp>
#include <system_error>

#include "base/output_file.h"
#include "base/whole_file.h"
#include "crate/supervisor/child_process.h"
#include "shm/shortage.h"

namespace mpf::crate {
namespace {

std::string bootId() { return readWholeFile("/proc/sys/kernel/random/boot_id"); }

}  // namespace

CrateState CrateState::read(const std::string& path) try {
  const auto json = nlohmann::json::parse(readWholeFile(path));
  CrateState state;
  if (json.at("boot") != bootId()) return state;
  state.file = json.at("crate");
  for (const auto& one : json.at("processes")) {
    state.processes.push_back({one.at("name"), one.at("pid"), one.at("startTicks"),
                               one.at("restarts"), one.at("command"), one.at("isStopRequested"),
                               one.value("context", "")});
  }
  return state;
} catch (const std::system_error& error) {
  // The processes may run: without them, a second one of each would be started.
  if (shortageOf(error) != layout::Shortage::none) throw;
  return {};
} catch (const nlohmann::json::exception&) {
  return {};
}

std::vector<RecordedProcess> CrateState::running() const {
  auto running = processes;
  std::erase_if(running, [](const RecordedProcess& process) {
    // startTicks 0: it had ended when it was recorded
    return process.pid == 0 || process.startTicks == 0 ||
           startTicksOf(process.pid) != process.startTicks;
  });
  return running;
}

void CrateState::write(const std::string& path) const {
  auto all = nlohmann::json::array();
  for (const auto& one : processes) {
    all.push_back({{"name", one.name},
                   {"pid", one.pid},
                   {"startTicks", one.startTicks},
                   {"restarts", one.restarts},
                   {"command", one.command},
                   {"isStopRequested", one.isStopRequested},
                   {"context", one.context}});
  }
  const nlohmann::json json{{"boot", bootId()}, {"crate", file}, {"processes", all}};
  replaceFile(path, json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n",
              0600);
}

}  // namespace mpf::crate
