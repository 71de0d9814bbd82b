// SPDX-License-Identifier: MIT
#include "crate/supervisor/crate_state.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <system_error>

#include <mpf/file_descriptor.h>

#include "base/output_file.h"
#include "base/system_call.h"
#include "base/whole_file.h"
#include "crate/supervisor/child_process.h"
#include "shm/shortage.h"

namespace mpf::crate {
namespace {

std::string bootId() { return readWholeFile("/proc/sys/kernel/random/boot_id"); }

// Overwrites a file within the blocks that it has. What remains of its old text becomes empty
// lines. Returns false if it has too few blocks.
bool tryOverwrite(const std::string& path, std::string text) {
  const FileDescriptor file(checkCall(::open(path.c_str(), O_WRONLY | O_CLOEXEC), "open", path));
  struct stat status{};
  checkCall(::fstat(file.get(), &status), "look at", path);
  constexpr blkcnt_t kBytes = 512;  // of a block in st_blocks
  const auto room = static_cast<std::size_t>(status.st_blocks * kBytes);
  if (text.size() > room) return false;
  text.resize(std::max(text.size(), static_cast<std::size_t>(status.st_size)), '\n');
  const auto written = checkCall(::pwrite(file.get(), text.data(), text.size(), 0), "write", path);
  return static_cast<std::size_t>(written) == text.size();
}

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
  const auto text = json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + '\n';
  try {
    replaceFile(path, text, 0600);
  } catch (const std::system_error& error) {
    const bool isFull = error.code() == std::errc::no_space_on_device ||
                        error.code() == std::error_code(EDQUOT, std::generic_category());
    if (!isFull || !tryOverwrite(path, text)) throw;
  }
}

}  // namespace mpf::crate
