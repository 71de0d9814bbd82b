// SPDX-License-Identifier: MIT
#include "router/config/tls_files.h"

#include <array>
#include <fmt/format.h>
#include <memory>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <system_error>

#include "base/whole_file.h"

namespace mpf::router {
namespace {

constexpr std::size_t kLongestChain = 10;  // the limit of kj

template <auto function>
struct FreeBy {
  template <class Thing>
  void operator()(Thing* thing) const noexcept {
    function(thing);
  }
};
using Bio = std::unique_ptr<BIO, FreeBy<BIO_free_all>>;
using Certificate = std::unique_ptr<X509, FreeBy<X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, FreeBy<EVP_PKEY_free>>;

// One of the files, and the text that errors about it begin with.
struct PemFile {
  PemFile(const Places& places, const char* name, std::string path)
      : file(std::move(path)), prefix(places.empty() ? file : places.of(name) + ": " + file) {}

  [[noreturn]] void refuse(const std::string& why) const {
    ERR_clear_error();  // otherwise a later call would report this error of OpenSSL
    throw ConfigError(prefix + " " + why);
  }
  [[nodiscard]] std::string text() const try {
    return readWholeFile(file);
  } catch (const std::system_error& error) {
    refuse("cannot be read: " + error.code().message());
  }

  std::string file;
  std::string prefix;
};

Bio reader(const std::string& text) {
  return Bio(::BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

std::vector<Certificate> certificatesIn(const PemFile& file, const std::string& text) {
  std::vector<Certificate> all;
  const auto bio = reader(text);
  while (Certificate one{::PEM_read_bio_X509(bio.get(), nullptr, nullptr, nullptr)})
    all.push_back(std::move(one));
  const auto isEnd = ERR_GET_REASON(::ERR_peek_last_error()) == PEM_R_NO_START_LINE;
  ::ERR_clear_error();
  if (!isEnd)
    file.refuse(
        fmt::format("is damaged: its certificate number {} cannot be read", all.size() + 1));
  if (all.empty())
    file.refuse("holds no certificate in PEM form: no line -----BEGIN CERTIFICATE-----");
  return all;
}

// A router has no terminal at which it could ask for a password.
int noPassword(char*, int, int, void* wasAsked) {
  *static_cast<bool*>(wasAsked) = true;
  return -1;
}

Key keyIn(const PemFile& file, const std::string& text) {
  bool wasAsked = false;
  Key key(::PEM_read_bio_PrivateKey(reader(text).get(), nullptr, noPassword, &wasAsked));
  if (wasAsked)
    file.refuse(
        "is protected by a password; store the key without a password, readable only by the "
        "router's user");
  if (!key && text.find("PRIVATE KEY-----") != std::string::npos)
    file.refuse("is damaged: its private key cannot be read");
  if (!key) file.refuse("holds no private key in PEM form: no line -----BEGIN PRIVATE KEY-----");
  return key;
}

std::string pemOf(X509& certificate) {
  const Bio bio(::BIO_new(::BIO_s_mem()));
  ::PEM_write_bio_X509(bio.get(), &certificate);
  char* bytes = nullptr;
  const auto length = BIO_get_mem_data(bio.get(), &bytes);
  return {bytes, static_cast<std::size_t>(length)};
}

std::string timeText(const ASN1_TIME* time) {
  tm parts{};
  ::ASN1_TIME_to_tm(time, &parts);
  return fmt::format("{:04}-{:02}-{:02} {:02}:{:02} UTC", parts.tm_year + 1900, parts.tm_mon + 1,
                     parts.tm_mday, parts.tm_hour, parts.tm_min);
}

}  // namespace

TlsTexts readTlsFiles(const TlsFiles& files, const Places& places) {
  const PemFile certificate(places, "certificate", files.certificate);
  const PemFile key(places, "key", files.key);
  const PemFile authorities(places, "authorities", files.authorities);
  TlsTexts texts{certificate.text(), key.text(), {}};
  const auto chain = certificatesIn(certificate, texts.certificate);
  if (chain.size() > kLongestChain)
    certificate.refuse(
        fmt::format("holds {} certificates: a chain has at most {}", chain.size(), kLongestChain));
  const auto ours = keyIn(key, texts.key);
  if (::X509_check_private_key(chain.front().get(), ours.get()) != 1) {
    key.refuse(fmt::format("is not the key of the first certificate in {}", files.certificate));
  }
  for (const auto& one : certificatesIn(authorities, authorities.text()))
    texts.authorities.push_back(pemOf(*one));
  return texts;
}

void checkTlsFiles(const TlsFiles& files, const Places& places) {
  const auto texts = readTlsFiles(files, places);
  const PemFile file(places, "certificate", files.certificate);
  const auto chain = certificatesIn(file, texts.certificate);
  const auto* const begin = ::X509_get0_notBefore(chain.front().get());
  const auto* const end = ::X509_get0_notAfter(chain.front().get());
  if (::X509_cmp_current_time(end) <= 0)
    file.refuse(fmt::format("expired on {}; renew it", timeText(end)));
  if (::X509_cmp_current_time(begin) > 0)
    file.refuse(
        fmt::format("is not valid before {}; check the clock of this host", timeText(begin)));
}

std::string certificateText(const TlsFiles& files) {
  const PemFile file({}, "certificate", files.certificate);
  const auto chain = certificatesIn(file, file.text());
  std::array<char, 256> name{};
  ::X509_NAME_get_text_by_NID(::X509_get_subject_name(chain.front().get()), NID_commonName,
                              name.data(), name.size());
  return fmt::format("{}, valid until {}", name.data(),
                     timeText(::X509_get0_notAfter(chain.front().get())));
}

}  // namespace mpf::router
