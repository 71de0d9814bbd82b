// SPDX-License-Identifier: MIT
// readConfig(): reads a RouterConfig from a TOML file; the code below names all keys.
#include <filesystem>
#include <fmt/format.h>

#include "base/toml/toml_table.h"
#include "router/config/limit_text.h"
#include "router/config/written_config.h"
#include "shm/rights_text.h"

namespace mpf::router {
namespace {

Security parseSecurity(const std::string& text) {
  if (text == "tls") return Security::tls;
  if (text == "plain") return Security::plain;
  throw std::invalid_argument(fmt::format(R"("{}": write "tls" or "plain")", text));
}

void readTransport(TomlTable& table, Address& address, Security& security) {
  table.readWith("address", [&](const std::string& text) { address = parseAddress(text); });
  table.readWith("security", [&](const std::string& text) { security = parseSecurity(text); });
}

void readServe(TomlTable& table, WrittenConfig& to) {
  Serve serve;
  table.read("location", serve.location);
  serve.local = serve.location;
  table.read("local", serve.local);
  table.finish({"location = 1"});
  to.config.serve.push_back(serve);
  to.places.serve.push_back(table.places());
}

void readListen(TomlTable& table, WrittenConfig& to) {
  Listen listen;
  readTransport(table, listen.address, listen.security);
  table.finish({R"(address = "*:9900")"});
  to.config.listen.push_back(listen);
  to.places.listen.push_back(table.places());
}

void readRemote(TomlTable& table, WrittenConfig& to) {
  Remote remote;
  table.read("locations", remote.locations);
  readTransport(table, remote.address, remote.security);
  table.read("tls-name", remote.tlsName);
  table.finish({"locations = [1]", R"(address = "ioc1.lab:9900")"});
  to.config.remotes.push_back(remote);
  to.places.remotes.push_back(table.places());
}

void readAllow(TomlTable& table, WrittenConfig& to) {
  Allow allow;
  table.read("peer", allow.peer);
  table.read("locations", allow.locations);
  table.read("servers", allow.servers);
  table.finish();
  to.config.allow.push_back(allow);
  to.places.allow.push_back(table.places());
}

// Paths are relative to the folder of the configuration file, because a service has another working
// directory than the user that wrote the file.
void readTls(TomlTable& table, WrittenConfig& to, const std::filesystem::path& folder) {
  auto& tls = to.config.tls;
  for (const auto& [key, path] : {std::pair{"certificate", &tls.certificate},
                                  {"key", &tls.key},
                                  {"authorities", &tls.authorities}}) {
    table.read(key, *path);
    if (!path->empty()) *path = (folder / *path).string();
  }
  table.finish(
      {R"(certificate = "ours.pem")", R"(key = "ours.key")", R"(authorities = "authorities.pem")"});
  to.places.tls = table.places();
}

void readLimits(TomlTable& table, WrittenConfig& to) {
  for (const auto& name : limitNames()) {
    table.readWith(name.c_str(),
                   [&](const std::string& text) { setLimit(to.config.limits, name, text); });
  }
  table.finish();
  to.places.limits = table.places();
}

void readRoot(TomlTable& table, WrittenConfig& to, const std::filesystem::path& folder) {
  auto& config = to.config;
  table.read("name", config.name);
  table.read("backplane", config.backplane);
  table.readWith("mode", [&](const std::string& text) { config.rights.mode = parseMode(text); });
  table.readWith("group", [&](const std::string& text) { config.rights.group = parseGroup(text); });
  table.read("log-level", config.logLevel);
  table.read("allow-public-plain", config.allowPublicPlain);
  table.readTable("tls", [&](TomlTable& tls) { readTls(tls, to, folder); });
  table.readTable("limits", [&](TomlTable& limits) { readLimits(limits, to); });
  table.readTables("serve", [&](TomlTable& serve) { readServe(serve, to); });
  table.readTables("listen", [&](TomlTable& listen) { readListen(listen, to); });
  table.readTables("remote", [&](TomlTable& remote) { readRemote(remote, to); });
  table.readTables("allow", [&](TomlTable& allow) { readAllow(allow, to); });
  table.finish();
}

}  // namespace

WrittenConfig readConfig(const std::string& file) {
  const auto root = parseTomlFile(file);
  WrittenConfig to;
  ConfigErrors errors;
  TomlTable table(root, file, "", errors);
  to.places.root = to.places.tls = to.places.limits = table.places();
  readRoot(table, to, std::filesystem::path(file).parent_path());
  errors.throwIfAny();
  return to;
}

RouterConfig loadConfig(const std::string& file) {
  auto written = readConfig(file);
  completeConfig(written);
  return written.config;
}

}  // namespace mpf::router
