// SPDX-License-Identifier: MIT
#include "crate/config/process_environment.h"

#include <unistd.h>

#include <fmt/format.h>
#include <map>
#include <pwd.h>

namespace mpf::crate {

std::vector<std::string> environmentOf(const ProcessPlan& plan) {
  std::map<std::string, std::string> variables;
  for (char** one = environ; *one != nullptr; ++one) {
    const std::string text = *one;
    const auto end = text.find('=');
    if (end != std::string::npos) variables[text.substr(0, end)] = text.substr(end + 1);
  }
  for (const auto* const name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"})
    variables.erase(name);
  // NOLINTNEXTLINE(concurrency-mt-unsafe): one thread at a time
  if (const auto* const user = plan.user.empty() ? nullptr : ::getpwnam(plan.user.c_str())) {
    variables["HOME"] = user->pw_dir;
    variables["USER"] = variables["LOGNAME"] = user->pw_name;
  }
  for (const auto& [name, value] : plan.environment) variables[name] = value;
  std::vector<std::string> texts;
  texts.reserve(variables.size());
  for (const auto& [name, value] : variables) texts.push_back(fmt::format("{}={}", name, value));
  return texts;
}

}  // namespace mpf::crate
