// SPDX-License-Identifier: MIT
// readCrate(): this file names all keys of a crate file; those of programs are in program_kinds.
#include "crate/config/read_crate.h"

#include <algorithm>
#include <filesystem>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <map>

#include "base/number.h"
#include "base/time_text.h"
#include "base/toml/toml_table.h"
#include "crate/config/program_kinds.h"

namespace mpf::crate {
namespace {

using std::chrono::milliseconds;

Restart parseRestart(const std::string& text) {
  if (text == "always") return Restart::always;
  if (text == "on-failure") return Restart::onFailure;
  if (text == "never") return Restart::never;
  throw std::invalid_argument(
      fmt::format(R"("{}": write "always", "on-failure" or "never")", text));
}

int parseCount(const std::string& text) {
  const auto value = tryNumber<int>(text);
  if (!value || *value < 0)
    throw std::invalid_argument(fmt::format("\"{}\": write a number, 0 or more", text));
  return *value;
}

constexpr const char* kDurationRule =
    "\"{}\": write a time with its unit, such as 500ms, 2s or 1min{}";

std::optional<milliseconds> tryDuration(std::string_view text) {
  const auto time = tryTime(text);
  if (!time || *time == Nanoseconds(0)) return std::nullopt;
  return std::chrono::ceil<milliseconds>(*time);
}

// Parses "4096", "64KiB", "4MiB" or "1GiB".
std::uint64_t parseSize(const std::string& text) {
  const auto unitAt = std::min(text.find_first_not_of("0123456789"), text.size());
  const auto unit = text.substr(unitAt);
  const int shift = unit.empty() ? 0 : unit == "KiB" ? 10 : unit == "MiB" ? 20 : 30;
  if (unitAt == 0 || unitAt > 9 || (shift == 30 && unit != "GiB"))
    throw std::invalid_argument(
        fmt::format("\"{}\": write a size, such as 4096, 64KiB or 10MiB", text));
  return static_cast<std::uint64_t>(parseCount(text.substr(0, unitAt))) << shift;
}

// The table to which a key belongs that another table has; empty: no table has it.
std::string placeOfKey(const std::string& key) {
  constexpr const char* kSupervision = "[supervision], or to a process such as [[server]]";
  constexpr const char* kProcess = "a process, such as [[server]]";
  constexpr const char* kTop = "the top of the file";
  constexpr const char* kBoth = "the top of the file, or to a process such as [[server]]";
  static const std::map<std::string, const char*> places{{"restart", kSupervision},
                                                         {"start-time", kSupervision},
                                                         {"stop-time", kSupervision},
                                                         {"stall-limit", kSupervision},
                                                         {"busy-limit", kSupervision},
                                                         {"first-pause", kSupervision},
                                                         {"last-pause", kSupervision},
                                                         {"max-restarts", kSupervision},
                                                         {"restart-window", kSupervision},
                                                         {"needs", kProcess},
                                                         {"servers", kProcess},
                                                         {"working-folder", kProcess},
                                                         {"arguments", kProcess},
                                                         {"program", "[[server]]"},
                                                         {"command", "[[program]]"},
                                                         {"notify", "[[program]]"},
                                                         {"count", "[capsules]"},
                                                         {"size", "[logs] or [capsules]"},
                                                         {"backplane", kTop},
                                                         {"carriers", kTop},
                                                         {"supervision", kTop},
                                                         {"capsules", kTop},
                                                         {"logs", kTop},
                                                         {"user", kBoth},
                                                         {"location", kBoth},
                                                         {"environment", kBoth}};
  const auto place = places.find(key);
  return place != places.end() ? place->second : tablesWith(key);
}

// Command lines, variables and names of files end at a NUL character.
void refuseNul(const TomlTable& root, const toml::node& node) {
  constexpr const char* kRule =
      "{} contains the character \\u0000, which no program can receive; remove it";
  if (const auto* const text = node.as_string();
      text != nullptr && text->get().find('\0') != std::string::npos)
    root.refuse(node, fmt::format(kRule, "the text"));
  if (const auto* const list = node.as_array())
    for (const auto& one : *list) refuseNul(root, one);
  if (const auto* const table = node.as_table()) {
    for (const auto& [key, value] : *table) {
      if (key.str().find('\0') != std::string_view::npos)
        root.refuse(value, fmt::format(kRule, "the key of this value"));
      refuseNul(root, value);
    }
  }
}

class CrateReader {
 public:
  CrateReader(Crate& crate, ConfigErrors& errors) : crate_(crate), errors_(errors) {}

  void readRoot(TomlTable& table) {
    crate_.places = table.places();
    table.read("name", crate_.name);
    table.read("backplane", crate_.backplane);
    table.read("location", crate_.location);
    table.read("user", crate_.user);
    for (const auto& key : commonKeys()) readSetting(table, {key, {}}, crate_.defaults);
    readEnvironment(table, crate_.environment);
    table.readTable("supervision", [&](TomlTable& limits) {
      readSupervision(limits, crate_.supervision);
      limits.finish({}, placeOfKey);
    });
    table.readTable("capsules", [&](TomlTable& capsules) {
      capsules.readWith("count",
                        [&](const std::string& text) { crate_.maxCapsules = parseCount(text); });
      capsules.readWith("size",
                        [&](const std::string& text) { crate_.maxCapsuleBytes = parseSize(text); });
      capsules.finish({}, placeOfKey);
    });
    table.readTable("logs", [&](TomlTable& logs) {
      logs.readWith("size", [&](const std::string& text) { crate_.maxLogBytes = parseSize(text); });
      logs.finish({}, placeOfKey);
    });
    table.readNamed("carriers", [&](const std::string& name, const toml::node& node) {
      if (const auto kind = node.value_exact<std::string>())
        crate_.carriers.push_back({name, *kind, table.placeOf(node), {}});
      else
        table.refuse(node, fmt::format("{} is {}; write a string in quotes, such as \"model\"",
                                       name, kindOf(node)));
    });
    table.readTables("server", [&](TomlTable& entry) { readProcess(entry, Entry::server, ""); });
    table.readTables("router",
                     [&](TomlTable& entry) { readProcess(entry, Entry::router, "router"); });
    table.readTables("ioc", [&](TomlTable& entry) { readProcess(entry, Entry::ioc, "ioc"); });
    table.readTables("program", [&](TomlTable& entry) { readCommand(entry); });
    table.finish({}, placeOfKey);
  }

 private:
  // A text, an integer, a number or a flag, as it is written in a command line.
  static std::optional<std::string> textOf(const toml::node& node) {
    if (auto text = node.value_exact<std::string>()) return text;
    if (const auto integer = node.value_exact<std::int64_t>()) return fmt::to_string(*integer);
    if (const auto number = node.value_exact<double>()) return fmt::format("{}", *number);
    if (const auto flag = node.value_exact<bool>()) return *flag ? "true" : "false";
    return std::nullopt;
  }

  // A value that is written as a table: its fields, joined by commas.
  std::optional<std::string> joinFields(const TomlTable& table, const toml::table& value,
                                        const OptionKind& option) {
    for (const auto& [key, node] : value) {
      if (std::ranges::find(option.fields, key.str()) == option.fields.end()) {
        errors_.add(fmt::format("{}:{}:{}", table.file(), key.source().begin.line,
                                key.source().begin.column),
                    fmt::format("{}: unknown key \"{}\"; {}", option.key, key.str(),
                                suggestion(key.str(), option.fields, "keys")));
        return std::nullopt;
      }
    }
    std::string joined;
    std::size_t used = 0;  // the length up to the last field that was written
    for (std::size_t i = 0; i < option.fields.size(); ++i) {
      if (i != 0) joined += ',';
      const auto* const node = value.get(option.fields[i]);
      if (node == nullptr) continue;
      const auto text = textOf(*node);
      if (text && text->empty()) {
        table.refuse(*node, fmt::format("{} of {} is empty; leave it out for its default",
                                        option.fields[i], option.key));
        return std::nullopt;
      }
      if (!text || text->find(',') != std::string::npos) {
        table.refuse(*node, fmt::format("{} of {} must be a text without commas, or a number",
                                        option.fields[i], option.key));
        return std::nullopt;
      }
      joined += *text;
      used = joined.size();
    }
    return joined.substr(0, used);
  }

  std::optional<std::string> readValue(const TomlTable& table, const toml::node& node,
                                       const OptionKind& option) {
    if (const auto* const value = node.as_table(); value != nullptr && !option.fields.empty())
      return joinFields(table, *value, option);
    auto text = textOf(node);
    if (!text)
      table.refuse(node,
                   fmt::format("{} is {}; write a text or a number", option.key, kindOf(node)));
    if (text && option.isFlag && *text != "true" && *text != "false") {
      table.refuse(node, fmt::format("{} is {}; write true or false", option.key, kindOf(node)));
      return std::nullopt;
    }
    return text;
  }

  void readSetting(TomlTable& table, const OptionKind& option, std::vector<Setting>& to) {
    const auto* const node = table.find(option.key.c_str());
    if (node == nullptr) return;
    Setting setting{option.key, {}, table.placeOf(*node)};
    const auto take = [&](const toml::node& one) {
      if (auto value = readValue(table, one, option)) setting.values.push_back(std::move(*value));
    };
    if (const auto* const list = node->as_array()) {
      if (list->empty())
        table.refuse(*node,
                     fmt::format("{} is an empty list; write at least one value", option.key));
      for (const auto& one : *list) take(one);
    } else {
      take(*node);
    }
    to.push_back(std::move(setting));
  }

  static void readEnvironment(TomlTable& table, std::map<std::string, std::string>& to) {
    table.readNamed("environment", [&](const std::string& name, const toml::node& node) {
      if (const auto text = textOf(node)) to[name] = *text;
      else table.refuse(node, fmt::format("{} is {}; write a text", name, kindOf(node)));
    });
  }

  static void readSupervision(TomlTable& table, Supervision& to) {
    const auto readTime = [&](const char* key, std::optional<milliseconds>& value,
                              milliseconds (*parse)(const std::string&) = parseDuration) {
      table.readWith(key, [&](const std::string& text) { value = parse(text); });
    };
    table.readWith("restart", [&](const std::string& text) { to.restart = parseRestart(text); });
    readTime("start-time", to.startTime);
    readTime("stop-time", to.stopTime);
    readTime("stall-limit", to.stallLimit, parseDurationOrOff);
    readTime("busy-limit", to.busyLimit, parseDurationOrOff);
    readTime("first-pause", to.firstPause);
    readTime("last-pause", to.lastPause);
    table.readWith("max-restarts",
                   [&](const std::string& text) { to.maxRestarts = parseCount(text); });
    readTime("restart-window", to.restartWindow);
  }

  // The keys that all processes have.
  void readCommon(TomlTable& table, Process& process) {
    table.read("name", process.name);
    table.read("servers", process.servers);
    table.read("needs", process.needs);
    table.read("user", process.user);
    table.read("working-folder", process.workingFolder);
    if (std::int32_t location = crate_.location; table.find("location") != nullptr) {
      table.read("location", location);
      process.location = location;
    }
    readEnvironment(table, process.environment);
    readSupervision(table, process.supervision);
    process.places = table.places();
    process.place = process.places.at("");
  }

  void readProcess(TomlTable& table, Entry entry, const std::string& defaultKind) {
    const auto errorsBefore = errors_.lines().size();
    Process process;
    process.kind = defaultKind;
    readCommon(table, process);
    table.read("arguments", process.command);
    process.notifies = entry != Entry::server;
    if (entry == Entry::server) table.read("program", process.kind);
    if (const auto* const kind = checkedKind(process, entry)) {
      readSettings(table, *kind, process);
      table.finish({}, placeOfKey);
      if (process.name.empty()) process.name = defaultName(process);
      process.isSound = errors_.lines().size() == errorsBefore;
      crate_.processes.push_back(std::move(process));
    }
  }

  // nullptr, and an error, if [[server]] names no program of MPF.
  const ProgramKind* checkedKind(const Process& process, Entry entry) {
    const auto* const kind = findKind(process.kind);
    if (kind != nullptr && kind->entry == entry) return kind;
    std::vector<std::string> names;
    for (const auto& one : programKinds())
      if (one.entry == Entry::server) names.push_back(one.name);
    if (process.kind.empty()) {
      errors_.add(process.place, fmt::format("[[server]] has no program; write program = \"{}\", "
                                             "or one of {}",
                                             names.front(), fmt::join(names, ", ")));
    } else {
      errors_.add(process.placeOf("program"),
                  fmt::format("unknown program \"{}\"; {}; a program that is not one of MPF is a "
                              "[[program]] with its command",
                              process.kind, suggestion(process.kind, names, "programs")));
    }
    return nullptr;
  }

  void readSettings(TomlTable& table, const ProgramKind& kind, Process& process) {
    for (const auto& key : kind.keys()) {
      if (key == "name" || key == "servers") continue;  // keys of all processes
      const auto* const option = kind.findOption(key);
      readSetting(table, option != nullptr ? *option : OptionKind{key, {}}, process.settings);
    }
  }

  static std::string defaultName(const Process& process) {
    for (const auto* const key : {"module", "server"}) {
      const auto value = process.valueOf(key);
      if (!value.empty()) return fieldsOf(value).front();
    }
    return process.kind;
  }

  void readCommand(TomlTable& table) {
    const auto errorsBefore = errors_.lines().size();
    Process process;
    readCommon(table, process);
    table.read("command", process.command);
    table.read("notify", process.notifies);
    table.finish({R"(name = "viewer")", R"(command = ["viewer", "--all"])"}, placeOfKey);
    process.isSound = errors_.lines().size() == errorsBefore;
    crate_.processes.push_back(std::move(process));
  }

  Crate& crate_;
  ConfigErrors& errors_;
};

}  // namespace

milliseconds parseDuration(const std::string& text) {
  if (const auto duration = tryDuration(text)) return *duration;
  throw std::invalid_argument(fmt::format(kDurationRule, text, ""));
}

milliseconds parseDurationOrOff(const std::string& text) {
  if (text == "off") return milliseconds(0);
  if (const auto duration = tryDuration(text)) return *duration;
  throw std::invalid_argument(fmt::format(kDurationRule, text, ", or off"));
}

Crate readCrate(const std::string& file) {
  ConfigErrors errors;
  auto crate = readCrate(file, errors);
  errors.throwIfAny();
  return crate;
}

Crate readCrate(const std::string& file, ConfigErrors& errors) {
  const auto root = parseTomlFile(file);
  Crate crate;
  crate.file = std::filesystem::absolute(file).lexically_normal().string();
  crate.name = std::filesystem::path(file).stem().string();
  TomlTable table(root, file, "", errors);
  refuseNul(table, root);
  errors.throwIfAny();
  CrateReader(crate, errors).readRoot(table);
  checkCrate(crate, errors);
  return crate;
}

}  // namespace mpf::crate
