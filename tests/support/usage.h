// SPDX-License-Identifier: MIT
// Usage: memory, open files and mapped segments of a process, to detect leaks.
#pragma once

#include <sys/types.h>
#include <unistd.h>

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <ostream>
#include <string>

#include "tests/support/sanitized.h"

namespace mpf::test {

struct Usage {
  std::size_t residentKb = 0;
  std::size_t files = 0;
  std::size_t segments = 0;

  static Usage of(pid_t pid) {
    const std::filesystem::path process = "/proc/" + std::to_string(pid);
    Usage usage;
    std::size_t pages = 0;
    std::ifstream(process / "statm") >> pages >> pages;  // the second number
    usage.residentKb = pages * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE)) / 1024;
    for ([[maybe_unused]] const auto& file : std::filesystem::directory_iterator(process / "fd"))
      ++usage.files;
    std::ifstream maps(process / "maps");
    for (std::string line; std::getline(maps, line);)
      usage.segments += line.find("/dev/shm/mpf") != std::string::npos ? 1 : 0;
    return usage;
  }
  // Whether it is at most `before`, apart from memory that an allocator keeps.
  [[nodiscard]] bool isWithin(const Usage& before, std::size_t slackKb) const {
    if (kIsSanitized) slackKb = std::size_t{1} << 20;  // sanitizers keep freed memory
    return files <= before.files && segments <= before.segments &&
           residentKb <= before.residentKb + slackKb;
  }
};

inline std::ostream& operator<<(std::ostream& out, const Usage& usage) {
  return out << usage.residentKb << " kB, " << usage.files << " files, " << usage.segments
             << " segments";
}

}  // namespace mpf::test
