// SPDX-License-Identifier: MIT
// Certificates and keys are checked before the first connection.
#include "router/config/tls_files.h"

#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <iterator>

#include "tests/router/certificates.h"
#include "tests/support/temporary_folder.h"

namespace mpf::router::test {
namespace {

std::string contents(const std::string& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

class TlsFilesTest : public testing::Test {
 protected:
  std::string complaintOf(const TlsFiles& files, const Places& places = {}) {
    try {
      checkTlsFiles(files, places);
      return "nothing";
    } catch (const ConfigError& error) {
      std::string text = error.what();
      const auto prefix = folder_.path().string() + "/";
      for (auto at = text.find(prefix); at != std::string::npos; at = text.find(prefix))
        text.erase(at, prefix.size());
      return text;
    }
  }
  mpf::test::TemporaryFolder folder_;
  Certificates ours_{folder_, "ours"};
  TlsFiles good_ = ours_.files("ioc1");
};

TEST_F(TlsFilesTest, AreAcceptedWhenValid) {
  EXPECT_EQ(complaintOf(good_), "nothing");
  const auto texts = readTlsFiles(good_);
  EXPECT_THAT(texts.authorities, testing::ElementsAre(contents(ours_.authorities())));
}

// A chain, and several authorities.
TEST_F(TlsFilesTest, MayContainSeveralCertificates) {
  const Certificates theirs(folder_, "theirs");
  good_.certificate =
      folder_.write("chain.pem", contents(good_.certificate) + contents(ours_.authorities()));
  good_.authorities = folder_.write("both.pem", "ours:\n" + contents(ours_.authorities()) +
                                                    "theirs:\n" + contents(theirs.authorities()));

  EXPECT_EQ(complaintOf(good_), "nothing");
  EXPECT_THAT(readTlsFiles(good_).authorities,
              testing::ElementsAre(contents(ours_.authorities()), contents(theirs.authorities())));
}

TEST_F(TlsFilesTest, ErrorsNameTheFileAndTheReason) {
  const auto damaged = folder_.write(
      "damaged.pem", "-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n");
  const auto damagedKey = folder_.write(
      "damaged.key", "-----BEGIN PRIVATE KEY-----\nAAAA\n-----END PRIVATE KEY-----\n");
  const auto text = folder_.write("text", "hello\n");
  const auto locked = folder_.file("locked.key");
  openssl({"pkey", "-in", good_.key, "-aes128", "-passout", "pass:word", "-out", locked});
  std::string tooLong;
  for (int i = 0; i < 11; ++i) tooLong += contents(good_.certificate);
  const auto& [certificate, key, authorities] = good_;
  const std::vector<std::pair<TlsFiles, std::string>> wrong{
      {{folder_.file("none"), key, authorities}, "none cannot be read: No such file or directory"},
      {{text, key, authorities},
       "text holds no certificate in PEM form: no line -----BEGIN CERTIFICATE-----"},
      {{damaged, key, authorities},
       "damaged.pem is damaged: its certificate number 1 cannot be read"},
      {{certificate, key, folder_.write("half.pem", contents(certificate) + contents(damaged))},
       "half.pem is damaged: its certificate number 2 cannot be read"},
      {{folder_.write("long.pem", tooLong), key, authorities},
       "long.pem holds 11 certificates: a chain has at most 10"},
      {{certificate, text, authorities},
       "text holds no private key in PEM form: no line -----BEGIN PRIVATE KEY-----"},
      {{certificate, certificate, authorities},
       "ours-ioc10.pem holds no private key in PEM form: no line -----BEGIN PRIVATE KEY-----"},
      {{certificate, damagedKey, authorities},
       "damaged.key is damaged: its private key cannot be read"},
      {{certificate, locked, authorities},
       "locked.key is protected by a password; store the key without a password, readable only by "
       "the router's user"},
      {{certificate, ours_.files("ioc2").key, authorities},
       "ours-ioc20.key is not the key of the first certificate in ours-ioc10.pem"},
      {{certificate, key, key},
       "ours-ioc10.key holds no certificate in PEM form: no line -----BEGIN CERTIFICATE-----"},
      {ours_.files("old", Valid::notAnyMore),
       "ours-old1.pem expired on 2021-02-03 04:05 UTC; renew it"},
      {ours_.files("new", Valid::notYet),
       "ours-new2.pem is not valid before 2098-01-02 03:04 UTC; check the clock of this host"},
  };
  for (const auto& [files, complaint] : wrong) EXPECT_EQ(complaintOf(files), complaint);
}

TEST_F(TlsFilesTest, ErrorsBeginWithThePlaceThatNamesTheFile) {
  good_.key = folder_.file("none");

  EXPECT_EQ(
      complaintOf(good_, {{"", "r.toml:1"}, {"certificate", "r.toml:2"}, {"key", "r.toml:3"}}),
      "r.toml:3: none cannot be read: No such file or directory");
}

}  // namespace
}  // namespace mpf::router::test
