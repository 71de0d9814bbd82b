// SPDX-License-Identifier: MIT
#include "crate/config/program_kinds.h"

#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace mpf::crate {
namespace {

// Options of the programs that drive modules of carriers.
std::vector<OptionKind> withHardware(std::vector<OptionKind> options) {
  options.push_back({"wait", {}, true});
  options.push_back({"real-time", {}});
  return options;
}

// NOLINTNEXTLINE(readability-function-size): a table
std::vector<ProgramKind> makeKinds() {
  std::vector<ProgramKind> kinds;
  kinds.push_back(
      {"serial",
       "mpf-serial-server",
       Entry::server,
       {"server", "port", "bufsize", "queuesize", "eomstr", "circular"},
       0,
       withHardware(
           {{"server", {"server", "port", "bufsize", "queuesize", "eomstr", "circular"}},
            {"baud", {}},
            {"parity", {}},
            {"stop-bits", {}},
            {"bits", {}},
            {"flow", {}},
            {"octal-uart", {"module", "carrier", "site", "nports", "vector"}},
            {"octal-port", {"port", "module", "n", "baud", "parity", "stopbits", "bits", "flow"}},
            {"octal-model", {}},
            {"octal-timing", {}, true},
            {"settle-time", {}},
            {"quiet-time", {}},
            {"resync-limit", {}},
            {"max-timeout", {}},
            {"max-retries", {}}}),
       true});
  kinds.push_back({"gpib",
                   "mpf-gpib-server",
                   Entry::server,
                   {"server", "module", "bufsize", "queuesize"},
                   2,
                   withHardware({{"timeout", {}},
                                 {"max-timeout", {}},
                                 {"max-lease", {}},
                                 {"poll-timeout", {}},
                                 {"ti9914", {"module", "carrier", "site", "vector"}},
                                 {"meter", {"address", "wire"}}}),
                   true});
  kinds.push_back({"dac128v",
                   "mpf-dac128v-server",
                   Entry::server,
                   {"module", "carrier", "site", "queuesize"},
                   3,
                   withHardware({{"ranges", {}}}),
                   true});
  kinds.push_back({"digital-io",
                   "mpf-digital-io-server",
                   Entry::server,
                   {"module", "carrier", "site", "queuesize", "mspoll", "intvec", "risingmask",
                    "fallingmask", "bimask", "maxclients"},
                   3,
                   withHardware({{"kind", {}}, {"input", {}}}),
                   true});
  kinds.push_back(
      {"ip330",
       "mpf-ip330-server",
       Entry::server,
       {"module", "carrier", "site", "type", "range", "first", "last", "maxclients", "vector"},
       3,
       withHardware({{"scan-mode", {}},
                     {"trigger", {}},
                     {"us-per-scan", {}},
                     {"seconds-between-calibrate", {}},
                     {"signal", {}},
                     {"scan", {"name", "first", "last", "ms", "queue"}},
                     {"config", {"name", "queue"}},
                     {"sweep", {"name", "first", "last", "points", "queue"}},
                     {"pid", {"name", "channel", "dac", "dacchannel", "queue"}},
                     {"dac", {"module", "carrier", "site"}}}),
       true});
  kinds.push_back({"ip440",
                   "mpf-ip440-server",
                   Entry::server,
                   {"module", "carrier", "site", "queuesize"},
                   3,
                   withHardware({{"inputs", {}}, {"input", {}}}),
                   true});
  for (const auto* const name : {"int32", "char8-array"}) {
    kinds.push_back({name,
                     std::string("mpf-") + name + "-server",
                     Entry::server,
                     {"server"},
                     0,
                     {{"queue-size", {}}}});
  }
  kinds.push_back({"router",
                   "mpf-router",
                   Entry::router,
                   {"file"},
                   0,
                   {{"serve", {}},
                    {"listen", {}},
                    {"remote", {}},
                    {"plain", {}, true},
                    {"allow-public-plain", {}, true},
                    {"tls-name", {}},
                    {"tls-certificate", {}},
                    {"tls-key", {}},
                    {"tls-authorities", {}},
                    {"queue-size", {}},
                    {"buffer-size", {}},
                    {"max-message-size", {}},
                    {"window-size", {}},
                    {"max-clients", {}},
                    {"max-connections", {}},
                    {"dead-time", {}},
                    {"handshake-time", {}},
                    {"first-retry", {}},
                    {"last-retry", {}}}});
  kinds.push_back(
      {"ioc", "mpf-ioc", Entry::ioc, {"startup"}, 0, {{"database", {}}, {"macros", {}}}});
  return kinds;
}

// Adds the field `field` of each value of an option.
void addField(const Process& process, const std::string& key, std::size_t field,
              std::vector<std::string>& to) {
  const auto* const setting = process.find(key);
  if (setting == nullptr) return;
  for (const auto& value : setting->values) {
    const auto fields = fieldsOf(value);
    if (field < fields.size()) to.push_back(fields[field]);
  }
}

}  // namespace

const OptionKind* ProgramKind::findOption(std::string_view key) const {
  const auto found = std::ranges::find(options, key, &OptionKind::key);
  return found != options.end() ? &*found : nullptr;
}

std::vector<std::string> ProgramKind::keys() const {
  auto all = positionals;
  for (const auto& option : options)
    if (std::ranges::find(all, option.key) == all.end()) all.push_back(option.key);
  if (entry == Entry::server) all.insert(all.end(), commonKeys().begin(), commonKeys().end());
  if (entry == Entry::router) all.insert(all.end(), {"mode", "group", "log-level"});
  return all;
}

const std::vector<ProgramKind>& programKinds() {
  static const auto kinds = makeKinds();
  return kinds;
}

const ProgramKind* findKind(std::string_view name) {
  const auto found = std::ranges::find(programKinds(), name, &ProgramKind::name);
  return found != programKinds().end() ? &*found : nullptr;
}

std::string tablesWith(const std::string& key) {
  std::vector<std::string> tables;
  std::vector<std::string> servers;
  for (const auto& kind : programKinds()) {
    if (const auto keys = kind.keys(); std::ranges::find(keys, key) == keys.end()) continue;
    if (kind.entry == Entry::server) servers.push_back(kind.name);
    else tables.push_back(fmt::format("[[{}]]", kind.name));
  }
  if (!servers.empty())
    tables.push_back(fmt::format("[[server]] of program \"{}\"", fmt::join(servers, "\", \"")));
  return fmt::to_string(fmt::join(tables, " or "));
}

const std::vector<std::string>& commonKeys() {
  static const std::vector<std::string> keys{"wait-mode", "mode", "group", "log-level"};
  return keys;
}

bool isPositional(const Process& process, const ProgramKind& kind, const std::string& key) {
  if (kind.name == "serial" && key == "server") return process.find("port") != nullptr;
  return std::ranges::find(kind.positionals, key) != kind.positionals.end();
}

std::vector<std::string> fieldsOf(const std::string& value) {
  std::vector<std::string> fields(1);
  for (const char one : value) {
    if (one == ',') fields.emplace_back();
    else fields.back() += one;
  }
  return fields;
}

std::vector<std::string> serversOf(const Process& process) {
  auto names = process.servers;
  const auto module = process.valueOf("module");
  if (process.kind == "dac128v" || process.kind == "ip440") {
    names.push_back(module);
  } else if (process.kind == "digital-io") {
    names.insert(names.end(), {module + "In", module + "Out"});
  } else if (process.kind == "ip330") {
    const auto before = names.size();
    for (const auto* const key : {"scan", "config", "sweep", "pid"})
      addField(process, key, 0, names);
    if (names.size() == before) names.insert(names.end(), {module, module + "Config"});
  } else if (process.kind == "serial") {
    addField(process, "server", 0, names);
  } else if (process.kind == "gpib") {
    names.push_back(process.valueOf("server"));
  } else if (process.kind == "int32" || process.kind == "char8-array") {
    const auto server = process.valueOf("server");
    const auto* const otherwise = process.kind == "int32" ? "Int32" : "Char8Array";
    names.push_back(server.empty() ? otherwise : server);
  }
  return names;
}

std::vector<DrivenModule> modulesOf(const Process& process) {
  std::vector<DrivenModule> modules;
  if (const auto* const carrier = process.find("carrier"))
    modules.push_back({process.valueOf("carrier"), process.valueOf("site"), carrier->place, false});
  for (const auto* const key : {"octal-uart", "ti9914", "dac"}) {
    const auto* const setting = process.find(key);
    if (setting == nullptr) continue;
    for (const auto& value : setting->values) {
      const auto fields = fieldsOf(value);
      if (fields.size() >= 3)
        modules.push_back({fields[1], fields[2], setting->place, setting->key == "dac"});
    }
  }
  return modules;
}

}  // namespace mpf::crate
