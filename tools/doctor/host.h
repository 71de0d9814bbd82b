// SPDX-License-Identifier: MIT
// Host: reads the properties of this computer, most of them from files of /proc, /sys and /etc.
// Tests replace the root folder and the functions.
//
// Threads  one.
// Trust    a file that is absent or may not be read is not an error: kernels and containers differ
//          in the files that they show.
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

  // Properties that no file shows.
  struct Space {
    std::uint64_t totalBytes = 0, freeBytes = 0, freeFiles = 0, totalFiles = 0;
  };
  std::function<std::optional<Space>()> sharedMemory = spaceOfSharedMemory;
  std::function<bool()> hasPidfd = kernelHasPidfd;

  // The text of a file without trailing white space; nullopt when the file cannot be read. `path`
  // is relative to the root.
  [[nodiscard]] std::optional<std::string> tryRead(const std::string& path) const;
  [[nodiscard]] std::vector<std::string> tryReadLines(const std::string& path) const;
  // The names in a folder, sorted; empty when the folder does not exist.
  [[nodiscard]] std::vector<std::string> list(const std::string& folder) const;

  // A mounted file system, as in /proc/self/mounts.
  struct Mount {
    std::string type;
    std::map<std::string, std::string> options;  // "ro" has an empty value
  };
  // The file system that was mounted there last, which is the visible one.
  [[nodiscard]] std::optional<Mount> mountAt(const std::string& point) const;
  // The value of a line of /proc/self/status: for "Uid" it is "1000 1000 1000 1000".
  [[nodiscard]] std::optional<std::string> ofProcess(const std::string& key) const;
  // The soft limit of this process in /proc/self/limits; nullopt when it cannot be read, UINT64_MAX
  // for "unlimited".
  [[nodiscard]] std::optional<std::uint64_t> limit(const std::string& name) const;
  [[nodiscard]] std::optional<std::uint64_t> number(const std::string& path) const;

  static std::optional<Space> spaceOfSharedMemory();
  static bool kernelHasPidfd();
};

// "512 B", "64.0 MiB", "1.5 GiB".
[[nodiscard]] std::string bytesText(std::uint64_t bytes);

}  // namespace mpf::tools
