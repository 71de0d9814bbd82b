// SPDX-License-Identifier: MIT
#include "router/config/router_config.h"

namespace mpf::router {

// Backtracks to the last star only: whatever more an earlier star could match, the last one can
// match as well.
bool matches(const std::string& pattern, const std::string& name) {
  std::size_t p = 0;
  std::size_t n = 0;
  std::size_t star = std::string::npos;  // position of the last star
  std::size_t used = 0;  // characters of the name before its match
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      used = n;
    } else if (p < pattern.size() && (pattern[p] == '?' || pattern[p] == name[n])) {
      ++p;
      ++n;
    } else if (star != std::string::npos) {
      p = star + 1;
      n = ++used;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', p) == std::string::npos;
}

}  // namespace mpf::router
