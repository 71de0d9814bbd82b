// SPDX-License-Identifier: MIT
#include "tools/call/unreachable.h"

#include <algorithm>
#include <fmt/format.h>

#include "base/printable.h"

namespace mpf::tools {
namespace {

bool isReachable(const Snapshot& snapshot, std::string_view server, std::int32_t location) {
  return std::ranges::any_of(snapshot.servers, [&](const WindowView& view) {
    return view.name == server && view.location == location && view.life != Life::dead;
  });
}

bool isOfThisHost(const Snapshot& snapshot, std::int32_t location) {
  return location == 0 || std::ranges::any_of(snapshot.servers, [&](const WindowView& server) {
           return server.location == location && server.router == 0;
         });
}

std::string reasonOf(const RouterView& router, const RouterLineView& line) {
  const auto peer = printable(line.peerText());
  if (router.life == Life::dead) return fmt::format("the router to {} has ended", peer);
  if (line.isConnected())
    return fmt::format(
        "the router is connected to {}: no server of this name runs there, or the [[allow]] rules "
        "of {} refuse it",
        peer, peer);
  return fmt::format("the router is not connected to {}{}{}", peer,
                     line.problem.empty() ? "" : ": ", printable(line.problem));
}

}  // namespace

std::string whyUnreachable(const Snapshot& snapshot, std::string_view server,
                           std::int32_t location) {
  if (isReachable(snapshot, server, location) || isOfThisHost(snapshot, location)) return {};
  std::string text = fmt::format("no router of this host has a remote with location {}", location);
  for (const auto& router : snapshot.routers) {
    for (const auto& line : router.lines) {
      const auto locations = line.locationList();
      if (!line.isClient() || std::ranges::find(locations, location) == locations.end()) continue;
      text = reasonOf(router, line);
      if (router.life != Life::dead) return text;
    }
  }
  return text;
}

}  // namespace mpf::tools
