// SPDX-License-Identifier: MIT
// Commands of routers. A router of the original MPF joins two hosts without encryption; so do
// these.
#include <algorithm>
#include <fmt/format.h>

#include "crate/startup/commands/command_table.h"
#include "crate/startup/commands/process_builder.h"

namespace mpf::startup {
namespace {

constexpr std::int64_t kMaxLocation = 2'147'483'647;

// Routers start with their commands.
Value routerInit(CommandCall& /*call*/, StartupSite& /*site*/) { return Value(); }

Value localMessageRouterStart(CommandCall& call, StartupSite& site) {
  const auto location = call.integer(0, "location", 0, kMaxLocation);
  if (!call.isValid()) return Value::unavailable();
  if (site.location.value_or(location) != location) {
    call.refuse(0, fmt::format("location {} differs from {} of an earlier line; this host has one "
                               "location",
                               location, *site.location));
    return Value::unavailable();
  }
  site.location = static_cast<std::int32_t>(location);
  return Value();
}

bool isAddress(const std::string& address) {
  constexpr std::string_view kCharacters =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.:-_[]";
  return address.find_first_not_of(kCharacters) == std::string::npos;
}

// (location, port, "address", bufSize, queueSize)
struct Route {
  std::int64_t location = 0;
  std::string address;  // "HOST:PORT"
  crate::Process process;
};

Route readRoute(CommandCall& call, StartupSite& site, const char* role) {
  Route route;
  route.location = call.integer(0, "location", 0, kMaxLocation);
  const auto port = call.integer(1, "TCP port", 1, 65535);
  auto address = site.address;
  if (address.empty()) {
    address = call.text(2, "address");
    if (!isAddress(address))
      call.refuse(2,
                  fmt::format("\"{}\" is not the address of a host; write it as \"10.0.0.7\", or "
                              "replace it by --address",
                              address));
  }
  const auto bufferSize = call.integer(3, "bufSize", 0, 64 << 20);
  const auto queueSize = call.integer(4, "queueSize", 0, 1'000'000);
  route.address = fmt::format("{}:{}", address, port);
  route.process =
      newProcess("router", fmt::format("{}-{}", role, port), call.place(), call.source());
  route.process.notifies = true;
  if (queueSize != 0)
    addValue(route.process, "queue-size", fmt::to_string(queueSize), call.place());
  if (bufferSize != 0)
    addValue(route.process, "buffer-size", fmt::to_string(std::max<std::int64_t>(bufferSize, 256)),
             call.place());
  addValue(route.process, "plain", "true", call.place());
  addValue(route.process, "allow-public-plain", "true", call.place());
  const auto hasName = [&](const auto& other) { return other.name == route.process.name; };
  if (call.isValid() && std::ranges::any_of(site.routers, hasName))
    call.refuse(1, fmt::format("TCP port {} is used by an earlier line; each pair of routers needs "
                               "its own",
                               port));
  return route;
}

// Servers of this host for clients of the other one.
Value tcpMessageRouterServerStart(CommandCall& call, StartupSite& site) {
  auto route = readRoute(call, site, "router-server");
  if (!call.isValid()) return Value::unavailable();
  addValue(route.process, "serve", fmt::to_string(route.location), call.place());
  addValue(route.process, "listen", route.address, call.place());
  site.routers.push_back(std::move(route.process));
  return Value();
}

// Clients of this host for servers of the other one.
Value tcpMessageRouterClientStart(CommandCall& call, StartupSite& site) {
  auto route = readRoute(call, site, "router-client");
  if (!call.isValid()) return Value::unavailable();
  addValue(route.process, "remote", fmt::format("{}={}", route.location, route.address),
           call.place());
  site.routers.push_back(std::move(route.process));
  return Value();
}

constexpr CommandEntry kRouterCommands[] = {
    {"routerInit", routerInit},
    {"localMessageRouterStart", localMessageRouterStart},
    {"tcpMessageRouterServerStart", tcpMessageRouterServerStart},
    {"tcpMessageRouterClientStart", tcpMessageRouterClientStart},
};

}  // namespace

std::span<const CommandEntry> routerCommands() { return kRouterCommands; }

}  // namespace mpf::startup
