// SPDX-License-Identifier: MIT
// Certificates: an authority of the test, and certificates that it signs. The command `openssl`
// makes them in the folder of the test.
//
//   const Certificates ours(folder, "ours");
//   Tls tls(ours.files("ioc1"), timer, 1h);   // certificate and key of ioc1, and its authorities
#pragma once

#include <string>
#include <vector>

#include "router/config/router_config.h"
#include "tests/support/temporary_folder.h"

namespace mpf::router::test {

// When a certificate is valid.
enum class Valid { now, notAnyMore, notYet };

class Certificates {
 public:
  // `authority` is the common name of the authority and the name of its files.
  Certificates(const mpf::test::TemporaryFolder& folder, std::string authority);

  // A certificate and a key whose common name and only host name is `name`.
  [[nodiscard]] TlsFiles files(const std::string& name, Valid valid = Valid::now) const;
  [[nodiscard]] const std::string& authorities() const noexcept { return authorities_; }

 private:
  const mpf::test::TemporaryFolder& folder_;
  std::string authority_;
  std::string authorities_;
};

// Runs `openssl`; throws std::runtime_error with its output when it fails.
void openssl(std::vector<std::string> arguments);

}  // namespace mpf::router::test
