// SPDX-License-Identifier: MIT
// TlsFiles, looked at before anybody connects: a file that is not there, or holds something else,
// is an error of the configuration.
//
// Threads  any.
#pragma once

#include <string>
#include <vector>

#include "router/config/written_config.h"

namespace mpf::router {

// What stands in the files, in PEM form.
struct TlsTexts {
  std::string certificate;  // and its chain
  std::string key;
  std::vector<std::string> authorities;  // one certificate each
};

// Every part is what it should be, and the key is the certificate's.
//   places  "certificate", "key" and "authorities", which errors begin with; none: errors begin
//           with the file's name
//   throws  ConfigError that names the file and says what is wrong with it
[[nodiscard]] TlsTexts readTlsFiles(const TlsFiles& files, const Places& places = {});

// The same, and our certificate is valid today.
void checkTlsFiles(const TlsFiles& files, const Places& places = {});

// Whose our certificate is and until when: "ioc1, valid until 2027-01-01 00:00 UTC".
[[nodiscard]] std::string certificateText(const TlsFiles& files);

}  // namespace mpf::router
