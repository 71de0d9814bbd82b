// SPDX-License-Identifier: MIT
// environmentOf: the environment of a process of a crate, for its start and for its check.
//
//   that of the supervisor < HOME, USER, LOGNAME of the plan's user < that of the plan
//
// Threads  one at a time: it reads the environment and the users of this host.
#pragma once

#include <string>
#include <vector>

#include "crate/config/process_plan.h"

namespace mpf::crate {

// "NAME=value" for each variable. The variables with which systemd watches the supervisor are left
// out, and those of a user that does not exist.
[[nodiscard]] std::vector<std::string> environmentOf(const ProcessPlan& plan);

}  // namespace mpf::crate
