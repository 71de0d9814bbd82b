// SPDX-License-Identifier: MIT
#include "crate/startup/commands/startup_site.h"

#include "crate/startup/commands/process_builder.h"

namespace mpf::startup {

crate::Process* StartupSite::findModule(const std::string& kind, const std::string& name) {
  for (auto& module : modules)
    if (module.kind == kind && module.valueOf("module") == name) return &module;
  return nullptr;
}

}  // namespace mpf::startup
