// SPDX-License-Identifier: MIT
// describe(): the text that `mpf-router --check` prints.
#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <grp.h>

#include "router/config/limit_text.h"
#include "router/config/router_config.h"
#include "router/config/tls_files.h"

namespace mpf::router {
namespace {

const char* transportText(Security security) {
  return security == Security::tls ? "TLS" : "plain TCP";
}

std::string serveText(const Serve& serve) {
  return serve.local == serve.location ? fmt::format("{}", serve.location)
                                       : fmt::format("{} (here {})", serve.location, serve.local);
}

std::string listenText(const Listen& listen) {
  return fmt::format("listens     {}, {}\n", listen.address.text(), transportText(listen.security));
}

std::string remoteText(const Remote& remote) {
  const auto name = remote.security == Security::tls
                        ? fmt::format(", certificate of {}", remote.tlsName)
                        : std::string();
  return fmt::format("connects    {}, {}{}, for location{} {}\n", remote.address.text(),
                     transportText(remote.security), name, remote.locations.size() == 1 ? "" : "s",
                     fmt::join(remote.locations, ", "));
}

// Empty for the default, the user's own group.
std::string groupText(std::uint32_t group) {
  if (group == Rights().group) return {};
  const auto* const entry = ::getgrgid(group);
  return entry != nullptr ? fmt::format(", group {}", entry->gr_name)
                          : fmt::format(", group {}", group);
}

std::string allowText(const Allow& allow) {
  const auto where = allow.locations.empty()
                         ? std::string("all locations")
                         : fmt::format("location {}", fmt::join(allow.locations, ", "));
  return fmt::format("allows      {} to bind to {} at {}\n", allow.peer,
                     fmt::join(allow.servers, ", "), where);
}

bool usesTls(const RouterConfig& config) {
  const auto isTls = [](const auto& one) { return one.security == Security::tls; };
  return std::ranges::any_of(config.listen, isTls) || std::ranges::any_of(config.remotes, isTls);
}

}  // namespace

std::string describe(const RouterConfig& config) {
  auto text = fmt::format("router      {}, on backplane {}, clients of this host: mode {:04o}{}\n",
                          config.name,
                          config.backplane.empty() ? "$MPF_BACKPLANE or default" : config.backplane,
                          config.rights.mode, groupText(config.rights.group));
  if (!config.serve.empty()) {
    text += "serves      location ";
    for (const auto& serve : config.serve)
      text += (&serve == config.serve.data() ? "" : ", ") + serveText(serve);
    text += "\n";
  }
  for (const auto& listen : config.listen) text += listenText(listen);
  for (const auto& allow : config.allow) text += allowText(allow);
  for (const auto& remote : config.remotes) text += remoteText(remote);
  if (usesTls(config)) text += fmt::format("certificate {}\n", certificateText(config.tls));
  text += "limits     ";
  for (const auto& name : limitNames())
    text += fmt::format(" {} {}", name, limitText(config.limits, name));
  return text + "\n";
}

}  // namespace mpf::router
