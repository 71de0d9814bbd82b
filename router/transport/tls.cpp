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

// kj 0.9 has no enumerator for TLS 1.3. It accepts the value after its last one, and then refuses
// TLS 1.2; a test checks this.
constexpr auto kTls13 = static_cast<kj::TlsVersion>(static_cast<int>(kj::TlsVersion::TLS_1_2) + 1);

enum class Side { server, client };

// kj verifies the server's certificate on the client side after the handshake, with a specific
// error, so only the server side requests verification during the handshake.
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
    R"(the peer does not use TLS: set the same security, "tls" or "plain", at both routers)";
constexpr const char* kNotVersion13 =
    "the peer does not support TLS 1.3, the only version that routers use";
constexpr std::string_view kOtherName = "the peer's certificate is for another name";
constexpr const char* kClosed = "the peer closed the connection during the TLS handshake";

struct Problem {
  std::string_view reported;  // part of the text of OpenSSL or kj
  std::string_view meaning;
};
constexpr std::array kProblems{
    Problem{"peer did not return a certificate", "the peer sent no certificate"},
    Problem{"certificate verify failed",
            "the peer's certificate was not signed by one of our authorities, or is not valid now"},
    Problem{"reason = certificate has expired", "the peer's certificate has expired"},
    Problem{"reason = certificate is not yet valid", "the peer's certificate is not valid yet"},
    Problem{"reason = hostname mismatch", kOtherName},
    Problem{"reason = unable to get local issuer",
            "the peer's certificate was not signed by one of our authorities"},
    Problem{"reason = self-signed certificate",
            "the peer's certificate was not signed by one of our authorities"},
    Problem{"alert certificate expired", "the peer refused our certificate: it has expired"},
    Problem{"alert unknown ca",
            "the peer refused our certificate: its authorities did not sign it"},
    Problem{"alert bad certificate", "the peer refused our certificate"},
    Problem{"alert certificate required",
            "the peer requires a certificate, and this router has sent none"},
    Problem{"alert protocol version", kNotVersion13},
    Problem{"unsupported protocol", kNotVersion13},
    Problem{"unable to continue I/O", kClosed},
    Problem{"wrong version number", kNoTls},
    Problem{"http request", kNoTls},
    Problem{"packet length too long", kNoTls},
    Problem{"record layer failure", kNoTls},
    Problem{"unexpected message", kNoTls},
    Problem{"operation timed out",
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

// The security depends on the peer's certificate, so this checks once more that there is one.
kj::Promise<kj::AuthenticatedStream> Tls::limited(kj::Promise<kj::AuthenticatedStream> handshake) {
  return timer_.timeoutAfter(handshake_, kj::mv(handshake))
      .then([](kj::AuthenticatedStream connected) {
        auto* const peer = dynamic_cast<kj::TlsPeerIdentity*>(connected.peerIdentity.get());
        if (peer == nullptr || !peer->hasCertificate())
          kj::throwFatalException(KJ_EXCEPTION(DISCONNECTED, kClosed));
        return connected;
      });
}

std::string peerName(kj::PeerIdentity& peer) {
  auto* const tls = dynamic_cast<kj::TlsPeerIdentity*>(&peer);
  if (tls == nullptr || !tls->hasCertificate()) return {};
  std::string name;
  static_cast<void>(kj::runCatchingExceptions([&] {  // a certificate may have no common name
    const auto common = tls->getCommonName();
    name.assign(common.begin(), common.size());
  }));
  return name;
}

std::string tlsProblem(const kj::Exception& error, const std::string& expectedName) {
  const std::string said = error.getDescription().cStr();
  const auto* const problem = std::ranges::find_if(
      kProblems, [&](const Problem& one) { return said.find(one.reported) != std::string::npos; });
  if (problem == kProblems.end()) return reasonOf(error);
  if (problem->meaning == kOtherName)
    return fmt::format("{}, not for \"{}\" (tls-name)", kOtherName, displayText(expectedName));
  return std::string(problem->meaning);
}

}  // namespace mpf::router
