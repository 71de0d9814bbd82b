// SPDX-License-Identifier: MIT
// Checks and reads TlsFiles before the first connection, so that a missing or invalid file is
// reported as an error in the configuration.
//
// Threads  any.
#pragma once

#include <string>
#include <vector>

#include "router/config/written_config.h"

namespace mpf::router {

// The contents of the files, in PEM form.
struct TlsTexts {
  std::string certificate;  // followed by its chain
  std::string key;
  std::vector<std::string> authorities;  // one certificate each
};

// Reads the files, checks that each has the expected content, and that the key belongs to the
// certificate.
//   places  where the keys "certificate", "key" and "authorities" are written; errors begin with
//           that place, or with the name of the file when `places` is empty
//   throws  ConfigError that names the file and its error
[[nodiscard]] TlsTexts readTlsFiles(const TlsFiles& files, const Places& places = {});

// As readTlsFiles(), and also checks that our certificate is valid now.
void checkTlsFiles(const TlsFiles& files, const Places& places = {});

// The name in our certificate and the end of its validity: "ioc1, valid until 2027-01-01 00:00
// UTC".
[[nodiscard]] std::string certificateText(const TlsFiles& files);

}  // namespace mpf::router
