// SPDX-License-Identifier: MIT
// checkCrate(): what concerns several entries of a crate.
#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <set>

#include "base/toml/toml_table.h"
#include "crate/config/program_kinds.h"
#include "crate/config/read_crate.h"

namespace mpf::crate {
namespace {

bool isFileName(const std::string& name) {
  const auto isAllowed = [](char one) {
    return static_cast<unsigned char>(one) > ' ' && one != '/' && one != 0x7f;
  };
  return !name.empty() && name.size() <= 100 && name.front() != '.' &&
         std::ranges::all_of(name, isAllowed);
}

// What is wrong with the name of a variable of the environment; empty: nothing.
std::string problemOfVariable(const std::string& name) {
  if (name.empty() || name.find('=') != std::string::npos)
    return R"(a name must not be empty and must not contain "="; write NAME = "VALUE")";
  if (name == "MPF_BACKPLANE")
    return "it is set by the crate; write backplane = \"NAME\" at the top of the file";
  if (name == "MPF_LOCATION")
    return "it is set by the crate; write location = NUMBER at the top of the file, or in a "
           "process such as [[server]]";
  if (name == "NOTIFY_SOCKET")
    return "it is set by the supervisor, if a [[program]] has notify = true; remove it here";
  return {};
}

class CrateCheck {
 public:
  CrateCheck(Crate& crate, ConfigErrors& errors) : crate_(crate), errors_(errors) {}

  void run() {
    if (const auto problem = problemOfName(crate_.name); !problem.empty())
      errors_.add(crate_.file, problem);
    if (crate_.processes.empty())
      errors_.add(crate_.file,
                  "the crate starts nothing; write a [[server]], [[router]], [[ioc]] "
                  "or [[program]]");
    if (const auto place = crate_.places.find("environment"); place != crate_.places.end())
      checkEnvironment(crate_.environment, place->second);
    for (auto& process : crate_.processes) {
      const auto errorsBefore = errors_.lines().size();
      checkName(process);
      checkRequired(process);
      checkNeeds(process);
      checkEnvironment(process.environment, process.placeOf("environment"));
      checkServers(process);
      checkModules(process);
      process.isSound = process.isSound && errors_.lines().size() == errorsBefore;
    }
    checkCycles();
  }

 private:
  void checkName(const Process& process) {
    if (const auto problem = problemOfName(process.name); !problem.empty())
      errors_.add(process.placeOf("name"), problem);
    const auto [first, isNew] = names_.emplace(process.name, &process);
    if (!isNew)
      errors_.add(process.placeOf("name"),
                  fmt::format("the process \"{}\" of {} has the same name; write another name = "
                              "\"...\"",
                              process.name, first->second->place));
  }

  void checkRequired(const Process& process) {
    if (process.kind.empty()) {
      if (process.command.empty())
        errors_.add(process.place, fmt::format("\"{}\" has no command", process.name));
      return;
    }
    const auto& kind = *findKind(process.kind);
    for (std::size_t i = 0; i < kind.required; ++i) requireKey(process, kind, i);
    if (kind.name == "serial" && process.find("server") == nullptr)
      errors_.add(process.place,
                  "[[server]] of program \"serial\" has no server; write server = "
                  "\"NAME\" and port = \"/dev/ttyS0\", or server = [{server = "
                  "\"NAME\", port = \"/dev/ttyS0\"}]");
    if (kind.name == "router" && process.find("file") == nullptr &&
        process.find("serve") == nullptr && process.find("remote") == nullptr)
      errors_.add(process.place,
                  "[[router]] has nothing to do; write file = \"router.toml\", "
                  "or serve and listen, or remote");
    checkGaps(process, kind);
    for (const auto& key : kind.positionals) checkPositional(process, kind, key);
  }

  void requireKey(const Process& process, const ProgramKind& kind, std::size_t position) {
    const auto& key = kind.positionals[position];
    if (process.find(key) == nullptr)
      errors_.add(process.place, fmt::format("[[server]] of program \"{}\" has no {}; write {} = "
                                             "\"...\"",
                                             kind.name, key, key));
  }

  // An argument of a command line cannot be left out if a later one is given.
  void checkGaps(const Process& process, const ProgramKind& kind) {
    const std::string* missing = nullptr;
    for (std::size_t i = kind.required; i < kind.positionals.size(); ++i) {
      const auto& key = kind.positionals[i];
      if (process.find(key) == nullptr) {
        if (missing == nullptr) missing = &key;
      } else if (missing != nullptr) {
        errors_.add(
            process.find(key)->place,
            fmt::format("{} needs {}, too, because the program takes them in this order: {}", key,
                        *missing, fmt::join(kind.positionals, ", ")));
      }
    }
  }

  void checkPositional(const Process& process, const ProgramKind& kind, const std::string& key) {
    const auto* const setting = process.find(key);
    if (setting == nullptr || setting->values.size() < 2 || !isPositional(process, kind, key))
      return;
    errors_.add(setting->place, fmt::format("{} is a list of {} values, but the program takes one "
                                            "value here; write {} = \"...\"",
                                            key, setting->values.size(), key));
  }

  void checkEnvironment(const std::map<std::string, std::string>& environment,
                        const std::string& place) {
    for (const auto& [name, value] : environment) {
      if (const auto problem = problemOfVariable(name); !problem.empty())
        errors_.add(place, fmt::format("environment: variable \"{}\": {}", name, problem));
    }
  }

  void checkNeeds(const Process& process) {
    std::vector<std::string> all;
    for (const auto& other : crate_.processes) all.push_back(other.name);
    for (const auto& need : process.needs) {
      if (std::ranges::find(all, need) == all.end())
        errors_.add(process.placeOf("needs"),
                    fmt::format("needs \"{}\": no process has this name; {}", need,
                                suggestion(need, all, "processes")));
    }
  }

  void checkServers(const Process& process) {
    const auto location = process.location.value_or(crate_.location);
    for (const auto& server : serversOf(process)) {
      const auto [first, isNew] = servers_.emplace(std::pair(location, server), &process);
      if (!isNew)
        errors_.add(process.place, fmt::format("the server \"{}\" is also in the process \"{}\" of "
                                               "{}; each name can be served once at a "
                                               "location",
                                               server, first->second->name, first->second->place));
    }
  }

  void checkModules(const Process& process) {
    std::vector<std::string> carriers;
    for (const auto& carrier : crate_.carriers) carriers.push_back(carrier.name);
    for (const auto& module : modulesOf(process)) {
      if (std::ranges::find(carriers, module.carrier) == carriers.end())
        errors_.add(
            module.place,
            fmt::format("carrier \"{}\" is not in [carriers]; {}", module.carrier,
                        carriers.empty()
                            ? fmt::format("write [carriers] and {} = \"model\"", module.carrier)
                            : suggestion(module.carrier, carriers, "carriers")));
      if (module.isShared) continue;
      const auto [first, isNew] = modules_.emplace(module.carrier + " " + module.site, &process);
      if (!isNew && first->second != &process)
        errors_.add(
            module.place,
            fmt::format("the module at {} of carrier \"{}\" is also driven by the process "
                        "\"{}\" of {}; only one process can drive a module",
                        module.site, module.carrier, first->second->name, first->second->place));
    }
  }

  void checkCycles() {
    std::set<const Process*> finished;
    for (const auto& process : crate_.processes) {
      std::vector<std::string> path;
      if (findCycle(process, path, finished)) {
        errors_.add(names_.at(path.front())->placeOf("needs"),
                    fmt::format("the needs form a cycle: {}; remove one of them",
                                fmt::join(path, " needs ")));
        return;
      }
    }
  }
  // Whether the needs of `process` lead to a cycle, which is left in `path`.
  //   path      the processes that lead to `process`
  //   finished  processes whose needs lead to no cycle
  bool findCycle(const Process& process, std::vector<std::string>& path,
                 std::set<const Process*>& finished) {
    if (finished.contains(&process)) return false;
    const auto first = std::ranges::find(path, process.name);
    const bool isCycle = first != path.end();
    if (isCycle) path.erase(path.begin(), first);
    path.push_back(process.name);
    if (isCycle) return true;
    for (const auto& need : process.needs) {
      const auto found = names_.find(need);
      if (found != names_.end() && findCycle(*found->second, path, finished)) return true;
    }
    path.pop_back();
    finished.insert(&process);
    return false;
  }

  Crate& crate_;
  ConfigErrors& errors_;
  std::map<std::string, const Process*> names_;
  std::map<std::pair<std::int32_t, std::string>, const Process*> servers_;  // by location and name
  std::map<std::string, const Process*> modules_;  // by "CARRIER SITE"
};

}  // namespace

std::string problemOfName(const std::string& name) {
  if (isFileName(name)) return {};
  return fmt::format(
      "name \"{}\": use 1 to 100 characters without blanks and slashes, and no dot at the "
      "beginning",
      name);
}

void checkCarrierNames(const Crate& crate, const std::map<std::string, std::string>& kinds,
                       ConfigErrors& errors) {
  std::vector<std::string> carriers;
  for (const auto& carrier : crate.carriers) carriers.push_back(carrier.name);
  for (const auto& [name, kind] : kinds) {
    if (name.empty() || std::ranges::find(carriers, name) != carriers.end()) continue;
    errors.add("", fmt::format("--carrier {}={}: {} has no carrier \"{}\"; {}", name, kind,
                               crate.file, name,
                               carriers.empty() ? "it has no carriers: leave the option out"
                                                : suggestion(name, carriers, "carriers")));
  }
}

void checkCrate(Crate& crate, ConfigErrors& errors) { CrateCheck(crate, errors).run(); }

}  // namespace mpf::crate
