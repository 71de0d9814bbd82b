// SPDX-License-Identifier: MIT
#include "router/outgoing/pending_binds.h"

#include <exception>

#include "shm/segment.h"
#include "shm/segment_name.h"
#include "shm/shortage.h"

namespace mpf::router {

std::set<ServerName> PendingBinds::look() {
  const auto& backplane = backplane_.name();
  std::map<std::string, Known> known;
  problem_.clear();
  for (const auto& name : segments::list(SegmentName::prefix(backplane) +
                                         static_cast<char>(NameKind::pendingBind) + '.')) {
    if (const auto found = known_.find(name); found != known_.end()) {
      known.insert(known_.extract(found));
      continue;
    }
    try {
      if (const auto header = segments::tryReadHeader(name, layout::SegmentKind::pendingBind)) {
        known[name] = {{header->location, segments::rawText(header->name)}, header->ownerWindow};
      }
    } catch (const std::exception& error) {
      // A segment that is invalid or that we may not read names no server. Without resources, it is
      // read later.
      if (shortageOf(error) != layout::Shortage::none) problem_ = error.what();
      else known[name] = {};
    }
  }
  known_ = std::move(known);
  std::set<ServerName> names;
  std::map<std::uint64_t, bool> alive;  // by incarnation of the client's window
  for (const auto& [segment, pendingBind] : known_) {
    const auto [found, isNew] = alive.try_emplace(pendingBind.client, false);
    if (isNew) {
      const auto window = SegmentName::keyed(backplane, NameKind::clientWindow, pendingBind.client);
      found->second =
          pendingBind.client != 0 && segments::probeOwner(window) == segments::Owner::alive;
    }
    if (found->second) names.insert(pendingBind.name);
  }
  return names;
}

}  // namespace mpf::router
