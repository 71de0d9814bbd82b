// SPDX-License-Identifier: MIT
// Certificates: an authority of the test's own, and what it signs, made by the command `openssl` in
// the test's folder.
//
//   const Certificates ours(folder, "ours");
//   Tls tls(ours.files("ioc1"), timer);       // certificate of ioc1, its key, and whom it trusts
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
  // The authority's own name and that of its files.
  Certificates(const mpf::test::TemporaryFolder& folder, std::string authority);

  // A certificate and a key whose common name and only host name is `name`.
  [[nodiscard]] TlsFiles files(const std::string& name, Valid valid = Valid::now) const;
  [[nodiscard]] const std::string& authorities() const noexcept { return authorities_; }

 private:
  const mpf::test::TemporaryFolder& folder_;
  std::string authority_;
  std::string authorities_;
};

// Runs `openssl`; throws what it said when it did not do it.
void openssl(std::vector<std::string> arguments);

}  // namespace mpf::router::test
