// SPDX-License-Identifier: MIT
// What a log with a limit on storms has written: how many lines, and for how many lines they stand.
#pragma once

#include <algorithm>
#include <cstdint>
#include <sstream>
#include <string>
#include <string_view>

namespace mpf::test {

// For how many lines a written line stands: the count of "(repeated 12 times in 1.0 s)" or "(the
// last of 12 such lines in 1.0 s)"; 1 without one.
inline std::uint64_t timesOf(const std::string& line) {
  for (const std::string_view mark : {" (repeated ", " (the last of "}) {
    const auto at = line.rfind(mark);
    if (at != std::string::npos) return std::stoull(line.substr(at + mark.size()));
  }
  return 1;
}

struct LogCount {
  std::uint64_t written = 0;  // lines in which `text` stands
  std::uint64_t meant = 0;  // lines that they stand for
  std::uint64_t all = 0;  // written lines of any kind
};

inline LogCount countLines(const std::string& log, const std::string& text) {
  LogCount count;
  std::istringstream lines(log);
  for (std::string line; std::getline(lines, line); ++count.all) {
    if (line.find(text) == std::string::npos) continue;
    ++count.written;
    count.meant += timesOf(line);
  }
  return count;
}

}  // namespace mpf::test
