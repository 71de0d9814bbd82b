// SPDX-License-Identifier: MIT
#include "tools/doctor/host.h"

#include <sys/statvfs.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <fstream>
#include <sstream>

#include <mpf/file_descriptor.h>

#include "base/number.h"

namespace mpf::tools {
namespace {

std::map<std::string, std::string> optionsOf(const std::string& text) {
  std::map<std::string, std::string> options;
  std::istringstream words(text);
  for (std::string word; std::getline(words, word, ',');) {
    const auto equals = word.find('=');
    options.insert_or_assign(word.substr(0, equals),
                             equals == std::string::npos ? "" : word.substr(equals + 1));
  }
  return options;
}

}  // namespace

std::optional<std::string> Host::tryRead(const std::string& path) const {
  std::ifstream file(root / path);
  std::ostringstream text;
  if (!file || !(text << file.rdbuf())) return std::nullopt;
  auto whole = text.str();
  whole.erase(whole.find_last_not_of(" \n") + 1);
  return whole;
}

std::vector<std::string> Host::tryReadLines(const std::string& path) const {
  std::vector<std::string> lines;
  std::istringstream text(tryRead(path).value_or(""));
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  return lines;
}

std::vector<std::string> Host::list(const std::string& folder) const {
  std::vector<std::string> names;
  std::error_code failure;
  for (std::filesystem::directory_iterator entry(root / folder, failure), end;
       !failure && entry != end; entry.increment(failure)) {
    names.push_back(entry->path().filename());
  }
  std::ranges::sort(names);
  return names;
}

std::optional<Host::Mount> Host::mountAt(const std::string& point) const {
  std::optional<Mount> last;
  for (const auto& line : tryReadLines("proc/self/mounts")) {
    std::istringstream words(line);
    std::string device, where, type, options;
    if (words >> device >> where >> type >> options && where == point)
      last = Mount{type, optionsOf(options)};
  }
  return last;
}

std::optional<std::string> Host::ofProcess(const std::string& key) const {
  for (const auto& line : tryReadLines("proc/self/status")) {
    if (!line.starts_with(key + ":")) continue;
    const auto start = line.find_first_not_of(" \t", key.size() + 1);
    return start == std::string::npos ? std::string() : line.substr(start);
  }
  return std::nullopt;
}

std::optional<std::uint64_t> Host::limit(const std::string& name) const {
  for (const auto& line : tryReadLines("proc/self/limits")) {
    if (!line.starts_with(name + " ")) continue;
    std::istringstream words(line.substr(name.size()));
    std::string soft;
    words >> soft;
    return soft == "unlimited" ? UINT64_MAX : tryNumber<std::uint64_t>(soft);
  }
  return std::nullopt;
}

std::optional<std::uint64_t> Host::number(const std::string& path) const {
  const auto text = tryRead(path);
  return text ? tryNumber<std::uint64_t>(*text) : std::nullopt;
}

std::optional<Host::Space> Host::spaceOfSharedMemory() {
  struct statvfs status{};
  if (::statvfs("/dev/shm", &status) != 0) return std::nullopt;
  // A file system without a limit on the number of files reports a total of 0.
  const bool isLimited = status.f_files != 0;
  return Space{.totalBytes = status.f_blocks * status.f_frsize,
               .freeBytes = status.f_bavail * status.f_frsize,
               .freeFiles = isLimited ? status.f_favail : UINT64_MAX,
               .totalFiles = isLimited ? status.f_files : UINT64_MAX};
}

bool Host::kernelHasPidfd() {
  return static_cast<bool>(
      FileDescriptor(static_cast<int>(::syscall(SYS_pidfd_open, ::getpid(), 0))));
}

std::string bytesText(std::uint64_t bytes) {
  constexpr std::array<const char*, 4> kUnits{"KiB", "MiB", "GiB", "TiB"};
  if (bytes < 1024) return fmt::format("{} B", bytes);
  auto value = static_cast<double>(bytes) / 1024;
  std::size_t unit = 0;
  for (; value >= 1024 && unit + 1 < kUnits.size(); ++unit) value /= 1024;
  return fmt::format("{:.1f} {}", value, kUnits[unit]);
}

}  // namespace mpf::tools
