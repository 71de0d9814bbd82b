// SPDX-License-Identifier: MIT
#include "router/config/access.h"

#include <algorithm>

namespace mpf::router {
namespace {

bool permits(const Allow& allow, const std::string& peer, std::int32_t location,
             const std::string& server) {
  const auto isOfServer = [&](const std::string& pattern) { return matches(pattern, server); };
  return matches(allow.peer, peer) &&
         (allow.locations.empty() ||
          std::ranges::find(allow.locations, location) != allow.locations.end()) &&
         std::ranges::any_of(allow.servers, isOfServer);
}

}  // namespace

const Serve* findAllowed(const RouterConfig& config, const std::string& peer, std::int32_t location,
                         const std::string& server) {
  const auto serve = std::ranges::find(config.serve, location, &Serve::location);
  if (serve == config.serve.end()) return nullptr;
  const auto isPermitted = [&](const Allow& allow) {
    return permits(allow, peer, location, server);
  };
  return config.allow.empty() || std::ranges::any_of(config.allow, isPermitted) ? &*serve : nullptr;
}

}  // namespace mpf::router
