// SPDX-License-Identifier: MIT
// completeConfig(): fills in defaults, and checks that the values of a configuration fit together.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <set>

#include "base/printable.h"
#include "router/config/tls_files.h"
#include "router/config/written_config.h"
#include "shm/segment_name.h"

namespace mpf::router {
namespace {

constexpr std::size_t kLongestRouterName = 63;
constexpr std::array<const char*, 7> kLogLevels{"trace", "debug",    "info", "warning",
                                                "error", "critical", "off"};

// `place` is empty for an option that is missing on the command line.
[[noreturn]] void refuse(const std::string& place, const std::string& why) {
  throw ConfigError((place.empty() ? "" : place + ": ") + why);
}

std::string hostName() {
  std::array<char, 256> name{};
  ::gethostname(name.data(), name.size() - 1);
  return std::string(name.data()).substr(0, kLongestRouterName);
}

class Completion {
 public:
  explicit Completion(WrittenConfig& written) : config_(written.config), places_(written.places) {}

  void run() {
    checkRoot();
    checkHasTask();
    checkServe();
    checkListen();
    checkRemotes();
    checkAllow();
    checkRetry();
    checkTls();
  }

 private:
  void checkRoot() {
    const auto& root = places_.root;
    if (config_.name.empty()) config_.name = hostName();
    const auto isPrintable =
        std::ranges::all_of(config_.name, [](char c) { return c >= ' ' && c <= '~'; });
    if (config_.name.size() > kLongestRouterName || !isPrintable) {
      refuse(root.of("name"), fmt::format("name \"{}\": use 1 to {} printable characters",
                                          printable(config_.name), kLongestRouterName));
    }
    if (std::ranges::find(kLogLevels, config_.logLevel) == kLogLevels.end()) {
      refuse(root.of("log-level"),
             fmt::format("log-level \"{}\": use {}", printable(config_.logLevel),
                         fmt::join(kLogLevels, ", ")));
    }
    constexpr mode_t kGroupReadsAndWrites = 0060;
    if (config_.rights.group != Rights().group &&
        (config_.rights.mode & kGroupReadsAndWrites) == 0) {
      refuse(root.of("group"), "the mode gives this group no access; write mode 0660, too");
    }
    try {
      if (!config_.backplane.empty()) SegmentName::checkBackplane(config_.backplane);
    } catch (const std::invalid_argument& error) {
      refuse(root.of("backplane"), error.what());
    }
  }

  void checkHasTask() const {
    const auto serve = places_.entry("serve");
    const auto listen = places_.entry("listen");
    if (config_.serve.empty() && config_.listen.empty() && config_.remotes.empty()) {
      refuse(places_.root.at(""), fmt::format("nothing to do: write {} and {} to offer servers of "
                                              "this host to other hosts, or {} to "
                                              "reach servers of other hosts",
                                              serve, listen, places_.entry("remote")));
    }
    if (!config_.serve.empty() && config_.listen.empty()) {
      refuse(places_.serve.front().at(""),
             fmt::format("no client can reach the served locations; write {}, too", listen));
    }
    if (config_.serve.empty() && !config_.listen.empty()) {
      refuse(places_.listen.front().at(""),
             fmt::format("this router listens, but serves no location; write {}, too", serve));
    }
  }

  void checkServe() const {
    std::set<std::int32_t> seen;
    for (std::size_t i = 0; i < config_.serve.size(); ++i) {
      const auto location = config_.serve[i].location;
      if (!seen.insert(location).second) {
        refuse(places_.serve[i].of("location"),
               fmt::format("location {} is served twice; write it once", location));
      }
    }
  }

  void checkListen() const {
    for (std::size_t i = 0; i < config_.listen.size(); ++i) {
      const auto& listen = config_.listen[i];
      const auto& places = places_.listen[i];
      checkPlain(listen.security, listen.address, places);
      for (std::size_t earlier = 0; earlier < i; ++earlier) {
        if (listen.address.port == 0 || config_.listen[earlier].address != listen.address) continue;
        refuse(places.of("address"),
               fmt::format("{} appears twice; write it once", listen.address.text()));
      }
    }
  }

  // A host name has no address until it is resolved; the code that resolves it calls isPublic()
  // again.
  void checkPlain(Security security, const Address& address, const Places& places) const {
    const auto isResolved = address.host == "*" || isIpAddress(address.host);
    if (security == Security::tls || config_.allowPublicPlain || !isResolved ||
        !isPublic(address.host))
      return;
    refuse(places.of("security"),
           fmt::format("plain TCP at {}, which is {}: use TLS, or a loopback, private or "
                       "link-local address, or write {}",
                       address.text(),
                       isAny(address.host) ? "every network of this host" : "a public address",
                       places_.isFile ? "allow-public-plain = true" : "--allow-public-plain"));
  }

  void checkRemotes() {
    std::set<std::int32_t> seen;
    for (std::size_t i = 0; i < config_.remotes.size(); ++i) {
      auto& remote = config_.remotes[i];
      const auto& places = places_.remotes[i];
      for (const auto location : remote.locations) {
        if (!seen.insert(location).second)
          refuse(places.of("locations"),
                 fmt::format("location {} appears twice in remotes; write it once", location));
        checkNotServedHere(location, places);
      }
      if (isAny(remote.address.host)) {
        refuse(places.of("address"),
               fmt::format("{} is a wildcard address to listen on; write the address of one host",
                           remote.address.text()));
      }
      if (remote.address.port == 0)
        refuse(places.of("address"),
               fmt::format("{}: the port must be 1 to 65535", remote.address.text()));
      checkPlain(remote.security, remote.address, places);
      completeTlsName(remote, places);
    }
  }

  void checkNotServedHere(std::int32_t location, const Places& places) const {
    for (std::size_t i = 0; i < config_.serve.size(); ++i) {
      const auto& serve = config_.serve[i];
      if (serve.location != location && serve.local != location) continue;
      refuse(places.of("locations"),
             fmt::format(
                 "location {} is remote here, but served by this host at {}; use another location",
                 location, places_.serve[i].of(serve.location == location ? "location" : "local")));
    }
  }

  void completeTlsName(Remote& remote, const Places& places) const {
    const auto key = places_.isFile ? "tls-name" : "--tls-name";
    const auto isNumber = isIpAddress(remote.address.host);
    if (remote.security == Security::plain && !remote.tlsName.empty())
      refuse(places.of("tls-name"), fmt::format("{} has no effect without TLS; remove it", key));
    if (remote.security == Security::plain) return;
    if (remote.tlsName.empty() && isNumber) {
      refuse(
          places.of("address"),
          fmt::format("{} is an IP address, and a certificate has a name; write {}, too: the name "
                      "in the certificate of that router",
                      remote.address.host, key));
    }
    if (isIpAddress(remote.tlsName))
      refuse(places.of("tls-name"),
             fmt::format("{} {} is an IP address; write a name", key, remote.tlsName));
    if (remote.tlsName.empty()) remote.tlsName = remote.address.host;
  }

  void checkAllow() const {
    const auto isTls = [](const Listen& listen) { return listen.security == Security::tls; };
    for (std::size_t i = 0; i < config_.allow.size(); ++i) {
      const auto& allow = config_.allow[i];
      const auto& places = places_.allow[i];
      if (config_.serve.empty())
        refuse(places.at(""), fmt::format("[[allow]] without {}: there is nothing to allow",
                                          places_.entry("serve")));
      for (const auto location : allow.locations) {
        if (std::ranges::find(config_.serve, location, &Serve::location) != config_.serve.end())
          continue;
        refuse(places.of("locations"), fmt::format("location {} is not served here", location));
      }
      if (std::ranges::find(allow.servers, "") != allow.servers.end() || allow.peer.empty()) {
        refuse(places.of(allow.peer.empty() ? "peer" : "servers"),
               "an empty pattern matches nothing; \"*\" matches everything");
      }
      if (allow.peer.find_first_not_of('*') != std::string::npos &&
          std::ranges::none_of(config_.listen, isTls)) {
        refuse(places.of("peer"),
               fmt::format(
                   "peer \"{}\" cannot match: peers have names only with TLS, and no {} uses TLS",
                   allow.peer, places_.entry("listen")));
      }
    }
  }

  void checkRetry() const {
    const auto& limits = config_.limits;
    if (limits.firstRetry <= limits.lastRetry) return;
    refuse(places_.limits.of("first-retry"),
           fmt::format("first-retry, {} ms, is longer than last-retry, {} ms",
                       limits.firstRetry.count(), limits.lastRetry.count()));
  }

  void checkTls() const {
    const auto* const place = firstTlsPlace();
    if (place == nullptr) return;
    const auto& tls = config_.tls;
    for (const auto& [key, file] : {std::pair{"certificate", &tls.certificate},
                                    {"key", &tls.key},
                                    {"authorities", &tls.authorities}}) {
      if (!file->empty()) continue;
      refuse(
          *place,
          places_.isFile
              ? "TLS needs [tls] with certificate, key and authorities; or write security = "
                "\"plain\""
              : fmt::format("TLS needs --tls-certificate, --tls-key and --tls-authorities; or add "
                            "--plain"));
    }
    checkTlsFiles(tls, places_.tls);
  }

  // The place of the first entry that uses TLS; nullptr when no entry uses it.
  [[nodiscard]] const std::string* firstTlsPlace() const {
    for (std::size_t i = 0; i < config_.listen.size(); ++i) {
      if (config_.listen[i].security == Security::tls) return &places_.listen[i].of("security");
    }
    for (std::size_t i = 0; i < config_.remotes.size(); ++i) {
      if (config_.remotes[i].security == Security::tls) return &places_.remotes[i].of("security");
    }
    return nullptr;
  }

  RouterConfig& config_;
  const ConfigPlaces& places_;
};

}  // namespace

void completeConfig(WrittenConfig& written) { Completion(written).run(); }

}  // namespace mpf::router
