// SPDX-License-Identifier: MIT
// RouterConfig: the configuration of a router: which locations it serves, where it listens, to
// which remotes it connects, and its limits.
//
// docs/router-configuration.md describes the TOML file. `mpf-router --help` shows the options,
// which replace the file in simple cases.
//
// Threads  plain data.
// Trust    loadConfig() checks every value; its errors name the file and the line.
#pragma once

#include <sys/socket.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/toml/config_errors.h"
#include "shm/window.h"

namespace mpf::router {

enum class Security { tls, plain };

// A host name or an IP address, and a port: "ioc1.lab:9900", "10.0.0.7:9900", "[fd00::7]:9900", or
// "*:9900" to listen on all addresses.
struct Address {
  std::string host;
  std::uint16_t port = 0;  // to listen: 0 lets the kernel choose

  [[nodiscard]] std::string text() const;  // as parseAddress() reads it
  bool operator==(const Address&) const = default;
};

// Servers of this host that clients of other hosts reach at `location`.
struct Serve {
  std::int32_t location = 0;
  std::int32_t local = 0;  // their location on this backplane; by default the same
  bool operator==(const Serve&) const = default;
};

struct Listen {
  Address address;
  Security security = Security::tls;
  bool operator==(const Listen&) const = default;
};

// A router of another host to which this router connects, for the clients of this host.
struct Remote {
  std::vector<std::int32_t> locations;  // the locations that are reached through it
  Address address;
  Security security = Security::tls;
  std::string tlsName;  // in its certificate; default: the host, unless that is an IP address
  bool operator==(const Remote&) const = default;
};

// A rule that allows peers to bind to servers. Without any rule, all peers may bind to all served
// locations; otherwise, a peer may bind to what at least one rule allows.
struct Allow {
  // Pattern (* and ?) for the common name of the peer's certificate; "*" also matches plain TCP.
  std::string peer = "*";
  std::vector<std::int32_t> locations;  // empty: all that are served
  std::vector<std::string> servers{"*"};  // patterns for the names of servers
  bool operator==(const Allow&) const = default;
};

struct Limits {
  // Messages of one connection that may wait to be sent (`queueSize` of the original MPF).
  std::uint32_t queueSize = 256;
  // Size up to which waiting messages share a frame (`bufSize` of the original MPF).
  std::uint32_t bufferBytes = 1u << 20;
  std::uint64_t maxMessageBytes = std::uint64_t{64} << 20;
  // Flow-control window: bytes of replies that one client has not taken yet.
  std::uint32_t windowBytes = std::uint32_t{4} << 20;
  std::uint32_t maxClients = 16000;  // per connection
  std::uint32_t maxConnections = 1000;  // accepted connections
  // A connection that shows no sign of life for this time is closed.
  std::chrono::milliseconds deadTime{2000};
  // Longest time for the TLS handshake of an accepted connection, and then for the peer's greeting.
  // An outgoing connection must finish TCP and TLS within deadTime.
  std::chrono::milliseconds handshakeTime{5000};
  // The pause before a reconnect: it begins with firstRetry, doubles up to lastRetry, and is
  // jittered.
  std::chrono::milliseconds firstRetry{100};
  std::chrono::milliseconds lastRetry{5000};
  bool operator==(const Limits&) const = default;
};

// PEM files. All three are required when a connection uses TLS.
struct TlsFiles {
  std::string certificate;  // of this router, followed by its chain
  std::string key;
  std::string authorities;  // certificates of the authorities that sign the peers' certificates
  bool operator==(const TlsFiles&) const = default;
};

struct RouterConfig {
  std::string name;  // shown to peers and by `mpf mrr`; default: the host name
  std::string backplane;  // default: $MPF_BACKPLANE, or "default"
  Rights rights{};  // which users of this host may be clients of remote servers
  std::string logLevel = "info";  // trace, debug, info, warning, error, critical, off
  bool allowPublicPlain = false;  // allows plain TCP with addresses for which isPublic() is true
  TlsFiles tls;
  std::vector<Serve> serve;
  std::vector<Listen> listen;
  std::vector<Remote> remotes;
  std::vector<Allow> allow;
  Limits limits;
  bool operator==(const RouterConfig&) const = default;
};

//   throws  ConfigError
[[nodiscard]] RouterConfig loadConfig(const std::string& file);

// Describes a configuration, with a line for each of its parts, for `mpf-router --check`.
[[nodiscard]] std::string describe(const RouterConfig& config);

// Parses "HOST:PORT".
//   throws  std::invalid_argument that quotes `text` and shows the form
[[nodiscard]] Address parseAddress(const std::string& text);

// Returns the host of an address in the form that the kernel reports for a peer: "10.0.0.7:40000"
// or "[fd00::7]:40000".
[[nodiscard]] inline std::string hostOf(const std::string& address) {
  return address.substr(0, address.rfind(':'));
}

// Whether `ip`, "10.0.0.7" or "fd00::7" without a port, is neither loopback, private (RFC 1918,
// fc00::/7) nor link-local. "*" and any text that is not an IP address count as public. Code that
// resolves a host name calls this before it uses plain TCP.
[[nodiscard]] bool isPublic(const std::string& ip);

// Whether `host` is an IPv4 or IPv6 address, and whether it is "*", "0.0.0.0" or "::".
[[nodiscard]] bool isIpAddress(const std::string& host);
[[nodiscard]] bool isAny(const std::string& host);

// Whether `name` matches `pattern`, in which * stands for any characters and ? for one character.
[[nodiscard]] bool matches(const std::string& pattern, const std::string& name);

}  // namespace mpf::router
