// SPDX-License-Identifier: MIT
// RouterConfig: what a router is told: whom it serves, where it listens, whom it calls, and within
// which limits.
//
// docs/router-configuration.md shows the TOML file; `mpf-router --help` the options, which make the
// same thing for a simple case.
//
// Threads  plain data.
// Trust    loadConfig() has checked every value, and says file and line of what is wrong.
#pragma once

#include <sys/socket.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "shm/window.h"

namespace mpf::router {

enum class Security { tls, plain };

// A name, an IPv4 or an IPv6 address, and a port. "ioc1.lab:9900", "10.0.0.7:9900",
// "[fd00::7]:9900", "*:9900" (listening, any).
struct Address {
  std::string host;
  std::uint16_t port = 0;  // listening: 0 lets the kernel choose

  [[nodiscard]] std::string text() const;  // as above
  bool operator==(const Address&) const = default;
};

// Servers of this host that clients elsewhere reach as `location`.
struct Serve {
  std::int32_t location = 0;
  std::int32_t local = 0;  // where they are on this backplane; usually the same
  bool operator==(const Serve&) const = default;
};

struct Listen {
  Address address;
  Security security = Security::tls;
  bool operator==(const Listen&) const = default;
};

// A router elsewhere that we call, for the clients of this host.
struct Remote {
  std::vector<std::int32_t> locations;  // all that are reached there
  Address address;
  Security security = Security::tls;
  // that its certificate must have; default: the address's host; an IP address has no default
  std::string tlsName;
  bool operator==(const Remote&) const = default;
};

// What a peer may bind to. No rule at all: everything that is served. Else: what one of the rules
// allows.
struct Allow {
  std::string peer =
      "*";  // pattern (* and ?) of the common name of its certificate; "*" also fits plain TCP
  std::vector<std::int32_t> locations;  // empty: all that are served
  std::vector<std::string> servers{"*"};  // patterns
  bool operator==(const Allow&) const = default;
};

struct Limits {
  // messages that may wait for the line, of one connection; the old `queueSize`
  std::uint32_t queueSize = 100;
  // of a frame: messages that share it end here; the old `bufSize`
  std::uint32_t bufferBytes = 1u << 20;
  std::uint64_t maxMessageBytes = std::uint64_t{64} << 20;
  // replies on their way to one client that it has not taken
  std::uint32_t windowBytes = std::uint32_t{4} << 20;
  std::uint32_t maxClients = 16000;  // of one connection
  std::uint32_t maxConnections = 1000;  // accepted
  std::chrono::milliseconds deadTime{2000};  // a line without a sign of life for so long is cut
  std::chrono::milliseconds handshakeTime{5000};  // of a peer: for TLS, and then for its greeting
  // back-off of reconnecting; jittered, doubled up to lastRetry
  std::chrono::milliseconds firstRetry{100};
  std::chrono::milliseconds lastRetry{5000};
  bool operator==(const Limits&) const = default;
};

// PEM files. All three, or none when nothing uses TLS.
struct TlsFiles {
  std::string certificate;  // ours, then the chain
  std::string key;
  std::string authorities;  // who signs our peers' certificates
  bool operator==(const TlsFiles&) const = default;
};

struct RouterConfig {
  std::string name;  // what peers and `mpf mrr` call this router; default: the host's name
  std::string backplane;  // default: $MPF_BACKPLANE, or "default"
  Rights rights{};  // who on this host may be a client of remote servers
  std::string logLevel = "info";  // trace, debug, info, warning, error, critical, off
  bool allowPublicPlain = false;  // plain TCP on addresses that are neither loopback nor private
  TlsFiles tls;
  std::vector<Serve> serve;
  std::vector<Listen> listen;
  std::vector<Remote> remotes;
  std::vector<Allow> allow;
  Limits limits;
  bool operator==(const RouterConfig&) const = default;
};

// "FILE:LINE: what is wrong and what would be right", or "--option: ..." of a command line.
class ConfigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

//   throws  ConfigError
[[nodiscard]] RouterConfig loadConfig(const std::string& file);

// What it means, for people: a line for each of its parts.
[[nodiscard]] std::string describe(const RouterConfig& config);

// "host:port" taken apart; throws std::invalid_argument that names it and shows how it is written.
[[nodiscard]] Address parseAddress(const std::string& text);

// The host of "10.0.0.7:40000" or "[fd00::7]:40000", as the kernel tells the address of a caller.
[[nodiscard]] inline std::string hostOf(const std::string& address) {
  return address.substr(0, address.rfind(':'));
}

// Whether `ip`, "10.0.0.7" or "fd00::7" without a port, is neither loopback, private (RFC 1918,
// fc00::/7) nor link-local. Whoever resolves a name asks this before plain TCP. "*", and what is no
// IPv4 or IPv6 address, is public.
[[nodiscard]] bool isPublic(const std::string& ip);

// Whether `host` is an IPv4 or IPv6 address, and whether it is "*", "0.0.0.0" or "::".
[[nodiscard]] bool isIpAddress(const std::string& host);
[[nodiscard]] bool isAny(const std::string& host);

// Whether `name` fits `pattern`, in which * stands for any characters and ? for one.
[[nodiscard]] bool fits(const std::string& pattern, const std::string& name);

}  // namespace mpf::router
