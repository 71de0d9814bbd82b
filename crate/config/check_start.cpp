// SPDX-License-Identifier: MIT
#include "crate/config/check_start.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <grp.h>
#include <list>
#include <pwd.h>
#include <set>
#include <sstream>

#include "crate/config/process_plan.h"
#include "crate/config/program_check.h"
#include "crate/config/program_kinds.h"
#include "drivers/industry_pack/check_carrier.h"
#include "shm/segment_name.h"

namespace mpf::crate {
namespace {

using Keys = std::set<std::string>;

// All programs together.
constexpr std::chrono::seconds kLongestCheck{20};
// Programs that run at the same time. Each needs a descriptor, of which a process often has 1024.
constexpr std::size_t kMostAtOnce = 64;

// What is wrong with a user; empty: nothing.
std::string problemOfUser(const std::string& user) {
  if (user.empty()) return {};
  const auto* const entry = ::getpwnam(user.c_str());  // NOLINT(concurrency-mt-unsafe)
  if (entry == nullptr) return fmt::format("user \"{}\": this host has no such user", user);
  if (::geteuid() == 0 || entry->pw_uid == ::geteuid()) return {};
  return fmt::format("user \"{}\": only root can start processes of another user", user);
}

// The carriers of models whose wires are in the folder of the crate, which only the user of the
// supervisor can enter.
std::vector<std::string> modelCarriersOf(const Crate& crate, const Process& process) {
  std::vector<std::string> names;
  for (const auto& module : modulesOf(process)) {
    const auto carrier = std::ranges::find(crate.carriers, module.carrier, &Carrier::name);
    if (carrier != crate.carriers.end() && carrier->kind == "model" &&
        std::ranges::find(names, carrier->name) == names.end())
      names.push_back(carrier->name);
  }
  return names;
}

// Whether the user exists, and is not the one of the supervisor.
bool isOtherUser(const std::string& user) {
  if (user.empty()) return false;
  const auto* const entry = ::getpwnam(user.c_str());  // NOLINT(concurrency-mt-unsafe)
  return entry != nullptr && entry->pw_uid != ::geteuid();
}

bool isProgram(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error) && ::access(path.c_str(), X_OK) == 0;
}

// Whether execvp() in the working folder finds the program.
bool isFound(const ProcessPlan& plan) {
  const std::filesystem::path folder(plan.workingFolder);
  const auto& program = plan.command.front();
  if (program.find('/') != std::string::npos) return isProgram(folder / program);
  const char* const path = std::getenv("PATH");  // NOLINT(concurrency-mt-unsafe): never changed
  std::istringstream folders(path != nullptr ? path : "/bin:/usr/bin");
  for (std::string one; std::getline(folders, one, ':');)
    if (isProgram(folder / one / program)) return true;
  return false;
}

// The plan of a process, whether or not those that it needs can be planned.
//   wrong  keys that are left out
ProcessPlan planOf(const Crate& crate, const Process& process, const Keys& wrong = {}) {
  const auto isWrong = [&](const Setting& setting) { return wrong.contains(setting.key); };
  auto alone = crate;
  alone.processes = {process};
  alone.processes.front().needs.clear();
  std::erase_if(alone.defaults, isWrong);
  std::erase_if(alone.processes.front().settings, isWrong);
  return planProcesses(alone, "/nonexistent").front();  // its programs open no wires
}

// A program that checks its arguments. It reports its first error: to find the next one, it is
// started again without the key of that error.
struct Checked {
  const Process* process;
  Keys wrong;
  ProgramCheck check;
};

class StartCheck {
 public:
  StartCheck(const Crate& crate, ConfigErrors& errors) : crate_(crate), errors_(errors) {}

  void run() {
    for (const auto& carrier : crate_.carriers)
      check(carrier.place, [&] { checkCarrier(carrier.kind); });
    const auto deadline = Deadline::after(kLongestCheck);
    for (const auto& process : crate_.processes) {
      while (programs_.size() >= kMostAtOnce) takeFirst(deadline);
      if (process.isSound) checkProcess(process);
      else if (process.kind.empty() && !process.command.empty()) checkProgram(process);
    }
    while (!programs_.empty()) takeFirst(deadline);
  }

 private:
  // An error that another process has, too, is added once.
  void add(const std::string& place, const std::string& text) {
    const auto line = place + ": " + text;
    if (std::ranges::find(errors_.lines(), line) == errors_.lines().end()) errors_.add(place, text);
  }
  // Adds the error that `act` throws.
  template <class Act>
  void check(const std::string& place, const Act& act) try {
    act();
  } catch (const std::exception& error) {
    const std::string text = error.what();
    add(place, text.substr(0, text.find_last_not_of('\n') + 1));
  }

  // The place of a key in the table of a process or, without it there, in the crate.
  [[nodiscard]] const std::string& placeOf(const Process& process, const std::string& key) const {
    if (process.places.contains(key)) return process.placeOf(key);
    const auto setting = std::ranges::find(crate_.defaults, key, &Setting::key);
    if (setting != crate_.defaults.end()) return setting->place;
    const auto place = crate_.places.find(key);
    return place != crate_.places.end() ? place->second : process.place;
  }

  void checkProcess(const Process& process) {
    const auto plan = planOf(crate_, process);
    const auto before = errors_.lines().size();
    check(placeOf(process, "backplane"), [&] { SegmentName::checkBackplane(plan.backplane); });
    for (const auto& server : plan.servers)
      check(process.placeOf("servers"), [&] { SegmentName::checkServer(server); });
    if (const auto problem = problemOfUser(plan.user); !problem.empty())
      add(placeOf(process, "user"), problem);
    else checkModels(process, plan.user);
    checkProgram(process);
    if (!process.kind.empty() && errors_.lines().size() == before) startCheck(process, {});
  }

  // Whether the program and its folder exist.
  void checkProgram(const Process& process) {
    const auto plan = planOf(crate_, process);
    std::error_code error;
    if (!std::filesystem::is_directory(plan.workingFolder, error))
      add(placeOf(process, "working-folder"),
          fmt::format("working-folder \"{}\": this host has no such folder", plan.workingFolder));
    else if (!isFound(plan))
      add(placeOf(process, "command"), textOfAbsent(process, plan.command.front()));
  }

  void checkModels(const Process& process, const std::string& user) {
    const auto carriers = modelCarriersOf(crate_, process);
    if (carriers.empty() || !isOtherUser(user)) return;
    add(placeOf(process, "user"),
        fmt::format(
            "user \"{}\": the process \"{}\" uses models (carrier \"{}\"), and their "
            "wires are in a folder that only the user of `mpf run` can enter; run `mpf run` "
            "as this user, or remove user",
            user, process.name, fmt::join(carriers, "\", \"")));
  }

  void startCheck(const Process& process, const Keys& wrong) {
    check(process.place, [&] {
      programs_.push_back({&process, wrong, ProgramCheck(planOf(crate_, process, wrong))});
    });
  }

  static std::string textOfAbsent(const Process& process, const std::string& program) {
    if (!process.kind.empty()) return fmt::format("{} is not installed", program);
    return fmt::format("there is no program \"{}\"{}", program,
                       program.find(' ') != std::string::npos
                           ? R"(; write command = ["PROGRAM", "ARGUMENT", ...])"
                           : "");
  }

  void takeFirst(const Deadline& deadline) {
    takeErrors(programs_.front(), deadline);
    programs_.pop_front();
  }

  // The first line decides the place: "queuesize: ..." or "--queuesize: ...".
  void takeErrors(Checked& checked, const Deadline& deadline) {
    auto lines = checked.check.errors(deadline);
    if (lines.empty()) return;
    auto& first = lines.front();
    first.erase(0, std::min(first.find_first_not_of('-'), first.size()));
    const auto key = first.substr(0, first.find_first_of(": "));
    const auto isOfWrongKey = [&](const std::string& one) {
      return first.find(one) != std::string::npos;
    };
    if (std::ranges::any_of(checked.wrong, isOfWrongKey)) return;  // it misses what was left out
    for (const auto& line : lines) add(placeOf(*checked.process, key), line);
    if (!isOption(*checked.process, key)) return;
    checked.wrong.insert(key);
    startCheck(*checked.process, checked.wrong);
  }

  // Whether a key has a value, and the program runs without it.
  [[nodiscard]] bool isOption(const Process& process, const std::string& key) const {
    const auto& positionals = findKind(process.kind)->positionals;
    return std::ranges::find(positionals, key) == positionals.end() &&
           (process.find(key) != nullptr ||
            std::ranges::find(crate_.defaults, key, &Setting::key) != crate_.defaults.end());
  }

  const Crate& crate_;
  ConfigErrors& errors_;
  std::list<Checked> programs_;  // that run
};

}  // namespace

void checkStart(const Crate& crate, ConfigErrors& errors) { StartCheck(crate, errors).run(); }

}  // namespace mpf::crate
