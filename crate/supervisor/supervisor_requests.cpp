// SPDX-License-Identifier: MIT
// Supervisor: the requests of mpf ps, mpf stop and the other commands.
#include <unistd.h>

#include <fmt/format.h>
#include <stdexcept>

#include <mpf/clock.h>

#include "base/print_error.h"
#include "base/service_manager.h"
#include "crate/supervisor/service_json.h"
#include "crate/supervisor/supervisor.h"

namespace mpf::crate {

nlohmann::json Supervisor::answer(const nlohmann::json& request) {
  const std::string what = request.at("do");
  const auto now = Clock::nowNs();
  if (what == "ps") return describe();
  if (what == "reload") reload();
  else if (what == "shutdown") beginShutdown();
  else if (what == "stop") memberOf(request).service.requestStop(now);
  else if (what == "start") memberOf(request).service.requestStart();
  else if (what == "restart") memberOf(request).service.requestRestart(now);
  else throw std::runtime_error(fmt::format("unknown request \"{}\"", what));
  tryRecord();
  return nlohmann::json::object();
}

void Supervisor::reload() try {
  ServiceManager::notifyReloading();
  auto fresh = load_();
  apply(planProcesses(fresh, folder_.path().string()));
  crate_ = std::move(fresh);
  logs_.setMaxBytes(crate_.maxLogBytes);
  capsuleWriter_.setLimits(crate_);
  printError("mpf run: reloaded {}\n", crate_.file);
  ServiceManager::notifyReady();
} catch (...) {
  ServiceManager::notifyReady();
  throw;
}

// The member that a request names.
Supervisor::Member& Supervisor::memberOf(const nlohmann::json& request) {
  const std::string name = request.at("name");
  if (auto* const member = find(name)) return *member;
  std::string names;
  for (const auto& one : members_) names += (names.empty() ? "" : ", ") + one->service.plan().name;
  throw std::runtime_error(fmt::format("the crate has no process \"{}\"; it has {}", name, names));
}

nlohmann::json Supervisor::describe() const {
  auto processes = nlohmann::json::array();
  for (const auto& member : members_) {
    auto one = toJson(member->service);
    one["log"] = folder_.log(member->service.plan().name);
    processes.push_back(std::move(one));
  }
  return {{"crate", crate_.name},
          {"file", crate_.file},
          {"folder", folder_.path().string()},
          {"pid", ::getpid()},
          {"processes", processes}};
}

}  // namespace mpf::crate
