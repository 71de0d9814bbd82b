// SPDX-License-Identifier: MIT
#include "crate/config/program_kinds.h"

#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <utility>

namespace mpf::crate {
namespace {

using Names = std::vector<std::string>;

// Adds the first field of each value of an option.
void addFirstFields(const Process& process, const std::string& key, Names& to) {
  const auto* const setting = process.find(key);
  if (setting == nullptr) return;
  for (const auto& value : setting->values) to.push_back(fieldsOf(value).front());
}

Names moduleServer(const Process& process) { return {process.valueOf("module")}; }

Names serialServers(const Process& process) {
  Names names;
  addFirstFields(process, "server", names);
  return names;
}

Names gpibServer(const Process& process) { return {process.valueOf("server")}; }

Names digitalIoServers(const Process& process) {
  const auto module = process.valueOf("module");
  return {module + "In", module + "Out"};
}

Names ip330Servers(const Process& process) {
  Names names;
  for (const auto* const key : {"scan", "config", "sweep", "pid"})
    addFirstFields(process, key, names);
  const auto module = process.valueOf("module");
  return names.empty() ? Names{module, module + "Config"} : names;
}

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
       true,
       serialServers});
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
                   true,
                   gpibServer});
  kinds.push_back({"dac128v",
                   "mpf-dac128v-server",
                   Entry::server,
                   {"module", "carrier", "site", "queuesize"},
                   3,
                   withHardware({{"ranges", {}}}),
                   true,
                   moduleServer});
  kinds.push_back({"digital-io",
                   "mpf-digital-io-server",
                   Entry::server,
                   {"module", "carrier", "site", "queuesize", "mspoll", "intvec", "risingmask",
                    "fallingmask", "bimask", "maxclients"},
                   3,
                   withHardware({{"kind", {}}, {"input", {}}}),
                   true,
                   digitalIoServers});
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
       true,
       ip330Servers});
  kinds.push_back({"ip440",
                   "mpf-ip440-server",
                   Entry::server,
                   {"module", "carrier", "site", "queuesize"},
                   3,
                   withHardware({{"inputs", {}}, {"input", {}}}),
                   true,
                   moduleServer});
  for (const auto& [name, otherwise] :
       {std::pair{"int32", "Int32"}, std::pair{"char8-array", "Char8Array"}}) {
    kinds.push_back({name,
                     std::string("mpf-") + name + "-server",
                     Entry::server,
                     {"server"},
                     0,
                     {{"queue-size", {}}},
                     false,
                     [otherwise](const Process& process) {
                       const auto server = process.valueOf("server");
                       return Names{server.empty() ? otherwise : server};
                     }});
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
  const auto* const kind = findKind(process.kind);
  if (kind == nullptr || !kind->servers) return names;
  const auto own = kind->servers(process);
  names.insert(names.end(), own.begin(), own.end());
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
