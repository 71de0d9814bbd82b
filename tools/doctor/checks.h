// SPDX-License-Identifier: MIT
// Check-up: what on a host would hurt MPF, and what helps. Each check is a function of its own that
// looks and says.
//
// Threads  one.
// Trust    what a host does not tell is `unknown`, never guessed.
#pragma once

#include <string>
#include <vector>

#include "tools/doctor/host.h"

namespace mpf::tools {

// `warning`: slower or less comfortable than it could be. `problem`: programs fail, or lose what
// they have.
enum class Health { ok, warning, problem, unknown };
[[nodiscard]] const char* toString(Health health) noexcept;

struct Finding {
  std::string check;
  Health health{};
  std::string seen;
  std::string remedy;  // empty when there is nothing to do
};

// Shared memory (check_up_memory.cpp).
[[nodiscard]] Finding checkMount(const Host& host);
[[nodiscard]] Finding checkSpace(const Host& host);
[[nodiscard]] Finding checkRights(const Host& host);
[[nodiscard]] Finding checkSegments(const Host& host);
[[nodiscard]] Finding checkNamespaces(const Host& host);
[[nodiscard]] Finding checkRemoveIpc(const Host& host);
// Processes and limits (check_up_process.cpp).
[[nodiscard]] Finding checkHidepid(const Host& host);
[[nodiscard]] Finding checkPidfd(const Host& host);
[[nodiscard]] Finding checkOpenFiles(const Host& host);
[[nodiscard]] Finding checkMaps(const Host& host);
[[nodiscard]] Finding checkAddressSpace(const Host& host);
[[nodiscard]] Finding checkInotify(const Host& host);
[[nodiscard]] Finding checkRealTime(const Host& host);
// Servers that run (check_up_server.cpp).
[[nodiscard]] Finding checkServers(const Host& host);
// Other hosts (check_up_router.cpp).
[[nodiscard]] Finding checkRouters(const Host& host);
// Processors and clocks (check_up_machine.cpp).
[[nodiscard]] Finding checkCpus(const Host& host);
[[nodiscard]] Finding checkClock(const Host& host);
[[nodiscard]] Finding checkGovernor(const Host& host);

// All of them, in this order.
[[nodiscard]] std::vector<Finding> runDoctorChecks(const Host& host);

}  // namespace mpf::tools
