// SPDX-License-Identifier: MIT
#include "crate/startup/commands/process_builder.h"

#include <algorithm>

namespace mpf::startup {
namespace {

crate::Setting& settingOf(crate::Process& process, const std::string& key,
                          const std::string& place) {
  const auto found = std::ranges::find(process.settings, key, &crate::Setting::key);
  return found != process.settings.end()
             ? *found
             : process.settings.emplace_back(crate::Setting{key, {}, place});
}

}  // namespace

std::string processName(const std::string& name) {
  auto result = name;
  for (auto& one : result)
    if (static_cast<unsigned char>(one) <= ' ' || one == '/' || one == 0x7f) one = '-';
  if (result.starts_with('.')) result.front() = '-';
  return result.substr(0, 100);
}

crate::Process newProcess(const std::string& kind, const std::string& name,
                          const std::string& place, const std::string& source) {
  crate::Process process;
  process.name = processName(name);
  process.kind = kind;
  process.place = place;
  process.comment = source;
  return process;
}

void addValue(crate::Process& process, const std::string& key, const std::string& value,
              const std::string& place) {
  settingOf(process, key, place).values.push_back(value);
}

void setValue(crate::Process& process, const std::string& key, const std::string& value,
              const std::string& place) {
  auto& setting = settingOf(process, key, place);
  setting.values = {value};
  setting.place = place;
}

}  // namespace mpf::startup
