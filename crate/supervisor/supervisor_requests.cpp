// SPDX-License-Identifier: MIT
// Supervisor: the requests of mpf ps, mpf stop and the other commands; reloads.
#include <unistd.h>

#include <algorithm>
#include <fmt/format.h>
#include <stdexcept>

#include <mpf/clock.h>

#include "base/print_error.h"
#include "base/service_manager.h"
#include "base/toml/config_errors.h"
#include "crate/supervisor/service_json.h"
#include "crate/supervisor/supervisor.h"

namespace mpf::crate {
namespace {

// The folder of a crate, and so its lock and its socket, have its name.
void checkName(const Crate& fresh, const CrateFolder& folder) {
  if (fresh.name == folder.name()) return;
  const auto place = fresh.places.find("name");
  ConfigErrors errors;
  errors.add(place != fresh.places.end() ? place->second : fresh.file,
             fmt::format("name: \"{}\" was \"{}\"; a reload cannot rename a crate: `mpf stop` it, "
                         "and start it again",
                         fresh.name, folder.name()));
  errors.throwIfAny();
}

}  // namespace

nlohmann::json Supervisor::answer(const nlohmann::json& request) {
  const std::string what = request.at("do");
  const auto now = Clock::nowNs();
  if (what == "ps") return describe();
  auto reply = nlohmann::json::object();
  if (what == "reload") reply["changed"] = reload();
  else if (what == "shutdown") beginShutdown();
  else if (what == "stop") memberOf(request).service.requestStop(now);
  else if (what == "start") memberOf(request).service.requestStart();
  else if (what == "restart") memberOf(request).service.requestRestart(now);
  else throw std::runtime_error(fmt::format("unknown request \"{}\"", what));
  tryRecord();
  return reply;
}

// Takes these plans in place of the present ones. Processes whose plans are unchanged continue.
// Returns the names of the others, without those that the user has stopped: they stay stopped.
std::vector<std::string> Supervisor::apply(const std::vector<ProcessPlan>& plans) {
  for (const auto& plan : plans) {  // first what may fail: then nothing has changed
    logs_.add(plan.name, folder_.log(plan.name));
    watches_.try_emplace(plan.backplane, plan.backplane);
  }
  std::vector<std::unique_ptr<Member>> fresh;
  std::vector<std::string> changed;
  for (const auto& plan : plans) {
    const auto found = std::ranges::find_if(members_, [&](const auto& member) {
      return member && member->service.plan() == plan && !member->isRemoved;
    });
    if (found != members_.end()) {
      fresh.push_back(std::move(*found));
    } else {
      fresh.push_back(std::make_unique<Member>(plan));
      const auto* const replaced = find(plan.name);
      if (replaced != nullptr && replaced->service.isStopRequested())
        fresh.back()->service.requestStop(Clock::nowNs());
      else changed.push_back(plan.name);
    }
  }
  // The others end. Those that are replaced are first in the list, so that their successors wait.
  for (auto& member : members_) {
    if (!member) continue;
    member->isRemoved = true;
    member->service.requestStop(Clock::nowNs());
    fresh.insert(fresh.begin(), std::move(member));
  }
  members_ = std::move(fresh);
  return changed;
}

// Returns the names of the processes that it starts or restarts.
std::vector<std::string> Supervisor::reload() try {
  ServiceManager::notifyReloading();
  auto fresh = load_();
  checkName(fresh, folder_);
  auto changed = apply(planProcesses(fresh, folder_.path().string()));
  crate_ = std::move(fresh);
  logs_.setMaxBytes(crate_.maxLogBytes);
  capsuleWriter_.setLimits(crate_);
  printError("mpf run: reloaded {}\n", crate_.file);
  ServiceManager::notifyReady();
  return changed;
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
