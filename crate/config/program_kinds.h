// SPDX-License-Identifier: MIT
// ProgramKinds: the programs of MPF that a crate can start, with their arguments and options. A
// test compares this table with the --help of each program.
//
// Threads  constant data.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "crate/config/crate.h"

namespace mpf::crate {

// An option of a program. With fields, a value may be written as a table whose keys are the fields.
struct OptionKind {
  std::string key;
  std::vector<std::string> fields;
  bool isFlag = false;  // true or false
};

// What an entry of a crate file is called: [[server]], [[router]] or [[ioc]].
enum class Entry { server, router, ioc };

struct ProgramKind {
  std::string name;  // in crate files: program = "serial"
  std::string program;  // "mpf-serial-server"
  Entry entry = Entry::server;
  std::vector<std::string> positionals;
  std::size_t required = 0;  // the first positionals, which must be there
  std::vector<OptionKind> options;
  bool usesCarriers = false;
  // The names of the servers of a process; empty: a kind without servers of its own.
  std::function<std::vector<std::string>(const Process&)> servers{};

  [[nodiscard]] const OptionKind* findOption(std::string_view key) const;
  // All keys: positionals, options, and those of all servers.
  [[nodiscard]] std::vector<std::string> keys() const;
};

[[nodiscard]] const std::vector<ProgramKind>& programKinds();
// nullptr: there is no such kind.
[[nodiscard]] const ProgramKind* findKind(std::string_view name);
// The tables of programs that have this key: "[[router]]", or "[[server]] of program "serial"";
// empty: no program has it.
[[nodiscard]] std::string tablesWith(const std::string& key);
// The keys that every server program has, and that a crate may set for all of them.
[[nodiscard]] const std::vector<std::string>& commonKeys();

// Whether the value of `key` is an argument without the name of an option. "server" of the serial
// server is its first argument with `port`, otherwise an option.
[[nodiscard]] bool isPositional(const Process& process, const ProgramKind& kind,
                                const std::string& key);

// The names under which clients find the servers of a process.
[[nodiscard]] std::vector<std::string> serversOf(const Process& process);

// A module of a carrier that a process drives.
struct DrivenModule {
  std::string carrier, site;
  std::string place;
  // Whether another process may drive it, too: the channels of a DAC are independent, so a PID
  // server may write one of them beside the server of the module.
  bool isShared = false;
};
[[nodiscard]] std::vector<DrivenModule> modulesOf(const Process& process);

// The fields of a value: "a,b,,d".
[[nodiscard]] std::vector<std::string> fieldsOf(const std::string& value);

}  // namespace mpf::crate
