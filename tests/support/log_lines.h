// SPDX-License-Identifier: MIT
// Counts the lines that a log with a LogLimiter has written, and the lines that they stand for.
#pragma once

#include <algorithm>
#include <cstdint>
#include <sstream>
#include <string>
#include <string_view>

namespace mpf::test {

// The number of lines that a written line stands for: the count in "(repeated 12 times in 1.0 s)"
// or "(the last of 12 such lines in 1.0 s)"; 1 without a count.
inline std::uint64_t timesOf(const std::string& line) {
  for (const std::string_view mark : {" (repeated ", " (the last of "}) {
    const auto at = line.rfind(mark);
    if (at != std::string::npos) return std::stoull(line.substr(at + mark.size()));
  }
  return 1;
}

struct LogCount {
  std::uint64_t written = 0;  // written lines that contain `text`
  std::uint64_t meant = 0;  // lines that these stand for
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
