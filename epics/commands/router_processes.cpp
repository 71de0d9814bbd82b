// SPDX-License-Identifier: MIT
#include "epics/commands/router_processes.h"

#include <algorithm>
#include <chrono>
#include <epicsExit.h>
#include <errlog.h>
#include <fmt/format.h>
#include <system_error>

#include "base/signals_blocked.h"
#include "epics/commands/child_program.h"

namespace mpf {

RouterProcesses& RouterProcesses::instance() {
  static auto* processes = [] {
    epicsAtExit([](void*) { instance().end(); }, nullptr);
    return new RouterProcesses;
  }();
  return *processes;
}

void RouterProcesses::connect(std::int32_t location, const std::string& address,
                              const std::vector<std::string>& options) {
  std::vector<std::string> arguments{"--remote", fmt::format("{}={}", location, address)};
  if (options.empty()) arguments.emplace_back("--plain");
  arguments.insert(arguments.end(), options.begin(), options.end());
  const SignalsBlocked blocked;
  const std::lock_guard lock(mutex_);
  if (threads_.contains(location)) return;
  threads_.emplace(location,
                   [this, arguments](const std::stop_token& stop) { run(stop, arguments); });
}

void RouterProcesses::end() {
  std::map<std::int32_t, std::jthread> threads;
  {
    const std::lock_guard lock(mutex_);
    threads.swap(threads_);
  }
  for (auto& [location, thread] : threads) thread.request_stop();  // the routers end together
}

void RouterProcesses::run(const std::stop_token& stop, const std::vector<std::string>& arguments) {
  constexpr int kInvalidArguments = 2;
  constexpr std::chrono::seconds kLongestPause{30};
  bool isOver = false;
  for (std::chrono::seconds pause{1}; !stop.stop_requested();
       pause = std::min(2 * pause, kLongestPause)) {
    std::string end;
    try {
      ChildProgram router("mpf-router", arguments);
      const std::stop_callback terminate(stop, [&] { router.terminate(); });
      const int status = router.wait();
      isOver = status == kInvalidArguments;
      end = fmt::format("ended with status {}", status);
    } catch (const std::system_error& error) {  // too many processes, no descriptor
      end = fmt::format("cannot be started now: {}", error.what());
    }
    if (stop.stop_requested()) return;
    errlogPrintf("mpf-router %s %s: %s\n", arguments[0].c_str(), arguments[1].c_str(), end.c_str());
    if (isOver) return;
    std::unique_lock lock(mutex_);
    ended_.wait_for(lock, stop, pause, [] { return false; });
  }
}

}  // namespace mpf
