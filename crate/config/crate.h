// SPDX-License-Identifier: MIT
// Crate: the processes that are started and supervised together, as their author wrote them.
//
//   crate.toml ─ readCrate() ──┐
//   st.cmd ─ startup files ────┴─► Crate ─ planProcesses() ─► ProcessPlan ─► supervisor
//                                    └─ writeCrate() ─► crate.toml
//
// Threads  plain data.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace mpf::crate {

// A key of a process with its values, as its program takes them: each value of an option that may
// be repeated is one text, with its fields joined by commas: "a-Serial[0],UART0[0],1000,20,\r,1".
struct Setting {
  std::string key;
  std::vector<std::string> values;
  std::string place;  // "FILE:LINE:COLUMN"
};

enum class Restart {
  always,  // whenever the process ends
  onFailure,  // unless it ends with status 0
  never
};

// Limits of the supervision of a process. A process without a value has that of its crate.
struct Supervision {
  std::optional<Restart> restart;
  std::optional<std::chrono::milliseconds> startTime;  // from the start until its servers bind
  std::optional<std::chrono::milliseconds> stopTime;  // from SIGTERM to SIGKILL
  std::optional<std::chrono::milliseconds> stallLimit;  // 0: a stalled server is not restarted
  std::optional<std::chrono::milliseconds> busyLimit;  // of one request; 0: none
  std::optional<std::chrono::milliseconds> firstPause;  // before a restart; each further is doubled
  std::optional<std::chrono::milliseconds> lastPause;  // the longest one
  std::optional<int> maxRestarts;  // within restartWindow; then the process has failed
  std::optional<std::chrono::milliseconds> restartWindow;
};

// The values for processes of a crate that sets none.
inline constexpr Restart kRestart = Restart::always;
inline constexpr std::chrono::milliseconds kStartTime{30'000};
inline constexpr std::chrono::milliseconds kStopTime{5'000};
inline constexpr std::chrono::milliseconds kStallLimit{10'000};
inline constexpr std::chrono::milliseconds kBusyLimit{0};
inline constexpr std::chrono::milliseconds kFirstPause{100};
inline constexpr std::chrono::milliseconds kLastPause{10'000};
inline constexpr int kMaxRestarts = 20;
inline constexpr std::chrono::milliseconds kRestartWindow{60'000};

// One process. Its program is one of programKinds(), or any other program.
struct Process {
  std::string name;  // unique in the crate
  std::string kind;  // of programKinds(); empty: `command` is the whole command line
  std::vector<std::string> command;  // without a kind; with one: further arguments, unchecked
  std::vector<Setting> settings;  // of a kind, in the order in which they were written
  std::vector<std::string> servers;  // names that must be bindable before it counts as ready
  bool notifies = false;  // reports that it is ready, as sd_notify(3) does
  std::vector<std::string> needs;  // processes that must be ready before it starts
  std::map<std::string, std::string> environment;
  std::string user;  // empty: the user of the supervisor
  std::string workingFolder;  // empty: the folder of the crate file
  std::optional<std::int32_t> location;  // nothing: that of the crate
  Supervision supervision;
  bool isSound = true;  // no error was found in its table
  std::string place;  // of the table
  std::map<std::string, std::string> places;  // of its keys
  std::string comment;  // text that writeCrate() puts above the table; lines without "# "

  // The place of a key, or of the table when the key is absent.
  [[nodiscard]] const std::string& placeOf(const std::string& key) const {
    const auto found = places.find(key);
    return found != places.end() ? found->second : place;
  }
  [[nodiscard]] const Setting* find(const std::string& key) const {
    for (const auto& setting : settings)
      if (setting.key == key) return &setting;
    return nullptr;
  }
  // The first value of a setting; empty when it is absent.
  [[nodiscard]] std::string valueOf(const std::string& key) const {
    const auto* const setting = find(key);
    return setting == nullptr || setting->values.empty() ? "" : setting->values.front();
  }
};

// A carrier of IndustryPack modules: `kind` is what --carrier takes, such as "model" or "tpci200".
struct Carrier {
  std::string name;
  std::string kind;
  std::string place;
  std::string comment;  // as that of a process
};

struct Crate {
  std::string name;
  std::string file;  // the file that was read
  std::string backplane;  // empty: $MPF_BACKPLANE, or "default"
  std::int32_t location = 0;
  std::vector<Setting> defaults;  // wait-mode, mode, group, log-level of all servers
  std::string user;
  std::map<std::string, std::string> environment;
  Supervision supervision;
  std::vector<Carrier> carriers;
  std::vector<Process> processes;
  // Capsules that are kept, and their size together.
  int maxCapsules = 100;
  std::uint64_t maxCapsuleBytes = 100u << 20;
  std::uint64_t maxLogBytes = 10u << 20;  // of each process
  std::map<std::string, std::string> places;  // of its keys
};

}  // namespace mpf::crate
