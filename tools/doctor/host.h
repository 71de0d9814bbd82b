// SPDX-License-Identifier: MIT
// Host: what this computer says of itself, mostly in files. A test gives it other files and other
// answers.
//
// Threads  one.
// Trust    a file that is not there or may not be read is no error: not every kernel or container
//          shows every one.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace mpf::tools {

struct Host {
  std::filesystem::path root = "/";

  // What no file says.
  struct Space {
    std::uint64_t totalBytes = 0, freeBytes = 0, freeFiles = 0, totalFiles = 0;
  };
  std::function<std::optional<Space>()> sharedMemory = spaceOfSharedMemory;
  std::function<bool()> hasPidfd = kernelHasPidfd;

  // A file's text without the blank at its end; nullopt when it cannot be read. `path` is relative
  // to the root.
  [[nodiscard]] std::optional<std::string> tryRead(const std::string& path) const;
  [[nodiscard]] std::vector<std::string> tryReadLines(const std::string& path) const;
  // Names in a folder, sorted; none when there is no such folder.
  [[nodiscard]] std::vector<std::string> list(const std::string& folder) const;

  // A mounted file system, as in /proc/self/mounts.
  struct Mount {
    std::string type;
    std::map<std::string, std::string> options;  // "ro" has an empty value
  };
  // The last one mounted there.
  [[nodiscard]] std::optional<Mount> mountAt(const std::string& point) const;
  // A line of /proc/self/status: "Uid" is "1000 1000 1000 1000".
  [[nodiscard]] std::optional<std::string> ofProcess(const std::string& key) const;
  // The soft limit of this process in /proc/self/limits; nullopt when it is not known, UINT64_MAX
  // for none.
  [[nodiscard]] std::optional<std::uint64_t> limit(const std::string& name) const;
  [[nodiscard]] std::optional<std::uint64_t> number(const std::string& path) const;

  static std::optional<Space> spaceOfSharedMemory();
  static bool kernelHasPidfd();
};

// "512 B", "64.0 MiB", "1.5 GiB".
[[nodiscard]] std::string bytesText(std::uint64_t bytes);

}  // namespace mpf::tools
