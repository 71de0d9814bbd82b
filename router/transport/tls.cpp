// SPDX-License-Identifier: MIT
#include "router/transport/tls.h"

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <kj/debug.h>
#include <string_view>
#include <vector>

#include "router/config/tls_files.h"
#include "router/transport/kj_text.h"

namespace mpf::router {
namespace {

// What kj 0.9 makes of one past its last enumerator: no TLS 1.2. A test sees to it.
constexpr auto kTls13 = static_cast<kj::TlsVersion>(static_cast<int>(kj::TlsVersion::TLS_1_2) + 1);

enum class Side { server, client };

// The client side looks at the certificate after the handshake, and can then say what is wrong with
// it; that is why it does not verify in it.
kj::TlsContext contextOf(const TlsTexts& texts, Side side) {
  const kj::TlsKeypair ours{
      kj::TlsPrivateKey(kj::StringPtr(texts.key.c_str(), texts.key.size())),
      kj::TlsCertificate(kj::StringPtr(texts.certificate.c_str(), texts.certificate.size()))};
  std::vector<kj::TlsCertificate> authorities;
  authorities.reserve(texts.authorities.size());
  for (const auto& text : texts.authorities)
    authorities.emplace_back(kj::StringPtr(text.c_str(), text.size()));
  kj::TlsContext::Options options;
  options.useSystemTrustStore = false;
  options.verifyClients = side == Side::server;
  options.trustedCertificates = kj::arrayPtr(authorities.data(), authorities.size());
  options.minVersion = kTls13;
  options.defaultKeypair = ours;
  return kj::TlsContext(options);
}

constexpr const char* kNoTls =
    "the peer does not use TLS: set the same security, \"tls\" or \"plain\", at both routers";
constexpr const char* kNotVersion13 =
    "the peer does not support TLS 1.3, the only version that routers use";
constexpr const char* kLeft = "the peer closed the connection during the TLS handshake";

struct Trouble {
  std::string_view said;  // by OpenSSL or kj
  std::string_view means;
};
constexpr std::array kTroubles{
    Trouble{"peer did not return a certificate", "the peer sent no certificate"},
    Trouble{"certificate verify failed",
            "the peer's certificate was not signed by one of our authorities, or is not valid now"},
    Trouble{"reason = certificate has expired", "the peer's certificate has expired"},
    Trouble{"reason = certificate is not yet valid", "the peer's certificate is not valid yet"},
    Trouble{"reason = hostname mismatch", "the peer's certificate is for another name"},
    Trouble{"reason = unable to get local issuer",
            "the peer's certificate was not signed by one of our authorities"},
    Trouble{"reason = self-signed certificate",
            "the peer's certificate was not signed by one of our authorities"},
    Trouble{"alert certificate expired", "the peer refused our certificate: it has expired"},
    Trouble{"alert unknown ca",
            "the peer refused our certificate: its authorities did not sign it"},
    Trouble{"alert bad certificate", "the peer refused our certificate"},
    Trouble{"alert certificate required",
            "the peer requires a certificate, and this router has sent none"},
    Trouble{"alert protocol version", kNotVersion13},
    Trouble{"unsupported protocol", kNotVersion13},
    Trouble{"unable to continue I/O", kLeft},
    Trouble{"wrong version number", kNoTls},
    Trouble{"http request", kNoTls},
    Trouble{"packet length too long", kNoTls},
    Trouble{"record layer failure", kNoTls},
    Trouble{"unexpected message", kNoTls},
    Trouble{"operation timed out",
            "the peer did not finish the TLS handshake in time (handshake-time)"},
};

}  // namespace

Tls::Tls(const TlsFiles& files, kj::Timer& timer, std::chrono::milliseconds handshake) try
    : timer_(timer),
      handshake_(handshake.count() * kj::MILLISECONDS),
      server_(contextOf(readTlsFiles(files), Side::server)),
      client_(contextOf(readTlsFiles(files), Side::client)) {
} catch (const kj::Exception& error) {  // a key that is too short, for example
  throw ConfigError(fmt::format("{} or {}: {}", files.certificate, files.authorities,
                                error.getDescription().cStr()));
}

kj::Promise<kj::AuthenticatedStream> Tls::accept(kj::AuthenticatedStream connection) {
  return limited(server_.wrapServer(kj::mv(connection)));
}

kj::Promise<kj::AuthenticatedStream> Tls::connect(kj::AuthenticatedStream connection,
                                                  const std::string& name) {
  return limited(client_.wrapClient(kj::mv(connection), name.c_str()));
}

// That the peer has shown its certificate is what all depends on, so it is looked at again.
kj::Promise<kj::AuthenticatedStream> Tls::limited(kj::Promise<kj::AuthenticatedStream> handshake) {
  return timer_.timeoutAfter(handshake_, kj::mv(handshake))
      .then([](kj::AuthenticatedStream connected) {
        auto* const peer = dynamic_cast<kj::TlsPeerIdentity*>(connected.peerIdentity.get());
        if (peer == nullptr || !peer->hasCertificate())
          kj::throwFatalException(KJ_EXCEPTION(DISCONNECTED, kLeft));
        return connected;
      });
}

std::string peerName(kj::PeerIdentity& peer) {
  auto* const tls = dynamic_cast<kj::TlsPeerIdentity*>(&peer);
  if (tls == nullptr || !tls->hasCertificate()) return {};
  std::string name;
  static_cast<void>(kj::runCatchingExceptions([&] {  // there may be other names, and no common one
    const auto common = tls->getCommonName();
    name.assign(common.begin(), common.size());
  }));
  return name;
}

std::string tlsTrouble(const kj::Exception& error) {
  const std::string said = error.getDescription().cStr();
  const auto* const trouble = std::ranges::find_if(
      kTroubles, [&](const Trouble& one) { return said.find(one.said) != std::string::npos; });
  return trouble != kTroubles.end() ? std::string(trouble->means) : reasonOf(error);
}

}  // namespace mpf::router
