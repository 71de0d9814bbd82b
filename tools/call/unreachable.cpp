// SPDX-License-Identifier: MIT
#include "tools/call/unreachable.h"

#include <algorithm>
#include <fmt/format.h>

#include "base/printable.h"
#include "base/process_stat.h"

namespace mpf::tools {
namespace {

// Returns null when there is no such server.
template <class IsWanted>
const WindowView* find(const Snapshot& snapshot, std::string_view server, IsWanted isWanted) {
  const auto found = std::ranges::find_if(snapshot.servers, [&](const WindowView& view) {
    return view.name == server && view.life != Life::dead && isWanted(view);
  });
  return found == snapshot.servers.end() ? nullptr : &*found;
}

const WindowView* findAt(const Snapshot& snapshot, std::string_view server, std::int32_t location) {
  return find(snapshot, server, [&](const auto& view) { return view.location == location; });
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
  if (findAt(snapshot, server, location) != nullptr || isOfThisHost(snapshot, location)) return {};
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

std::string connectionHint(const Snapshot& snapshot, std::string_view server,
                           std::int32_t location) {
  if (const auto* const view = findAt(snapshot, server, location))
    return isStopped(view->processState) ? fmt::format(" (its process {} is stopped)", view->pid)
                                         : "";
  if (const auto why = whyUnreachable(snapshot, server, location); !why.empty()) return ": " + why;
  if (const auto* const other = find(snapshot, server, [](const auto&) { return true; }))
    return fmt::format("; it runs at location {0}: --location {0}", other->location);
  return {};
}

}  // namespace mpf::tools
