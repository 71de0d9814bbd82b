// SPDX-License-Identifier: MIT
// The checks of `mpf doctor`: each function examines one property of the host that MPF depends on
// and returns what it found and how to remedy a fault.
//
// Threads  one.
// Trust    a property that the host does not show is `unknown`; no check guesses.
#pragma once

#include <string>
#include <vector>

#include "tools/doctor/host.h"

namespace mpf::tools {

// `warning`: MPF works, but is slower or less convenient than it could be. `problem`: programs fail
// or lose their segments.
enum class Health { ok, warning, problem, unknown };
[[nodiscard]] const char* toString(Health health) noexcept;

struct Finding {
  std::string check;
  Health health{};
  std::string seen;
  std::string remedy;  // empty when there is nothing to do
};

// Shared memory (memory_checks.cpp).
[[nodiscard]] Finding checkMount(const Host& host);
[[nodiscard]] Finding checkSpace(const Host& host);
[[nodiscard]] Finding checkRights(const Host& host);
[[nodiscard]] Finding checkSegments(const Host& host);
[[nodiscard]] Finding checkNamespaces(const Host& host);
[[nodiscard]] Finding checkRemoveIpc(const Host& host);
// Processes and limits (process_checks.cpp).
[[nodiscard]] Finding checkHidepid(const Host& host);
[[nodiscard]] Finding checkPidfd(const Host& host);
[[nodiscard]] Finding checkOpenFiles(const Host& host);
[[nodiscard]] Finding checkMaps(const Host& host);
[[nodiscard]] Finding checkAddressSpace(const Host& host);
[[nodiscard]] Finding checkInotify(const Host& host);
[[nodiscard]] Finding checkRealTime(const Host& host);
// Running servers (server_checks.cpp).
[[nodiscard]] Finding checkServers(const Host& host);
// Connections to other hosts (router_checks.cpp).
[[nodiscard]] Finding checkRouters(const Host& host);
// Processors and clocks (machine_checks.cpp).
[[nodiscard]] Finding checkCpus(const Host& host);
[[nodiscard]] Finding checkClock(const Host& host);
[[nodiscard]] Finding checkGovernor(const Host& host);

// Runs all checks: shared memory, processes and limits, processors and clocks, servers, routers.
[[nodiscard]] std::vector<Finding> runDoctorChecks(const Host& host);

}  // namespace mpf::tools
