// SPDX-License-Identifier: MIT
#include "router/config/router_config.h"

namespace mpf::router {

// Of the stars only the last one is ever tried again: what an earlier one took more, this one can
// take as well.
bool fits(const std::string& pattern, const std::string& name) {
  std::size_t p = 0;
  std::size_t n = 0;
  // the last star, and how much of the name was used up by then
  std::size_t star = std::string::npos;
  std::size_t used = 0;
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
