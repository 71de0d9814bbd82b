// SPDX-License-Identifier: MIT
// CapsuleStore: the folder in which capsules are kept, limited by number and size.
//
// Threads  one.
// Crash    a capsule gets its name when it is complete.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace mpf::crate {

class CapsuleStore {
 public:
  explicit CapsuleStore(std::filesystem::path folder, std::size_t maxFiles = 100,
                        std::uint64_t maxBytes = std::uint64_t{100} << 20)
      : folder_(std::move(folder)), maxFiles_(maxFiles), maxBytes_(maxBytes) {}

  // Writes a file for this user only, and removes the oldest ones above the limits; the new one is
  // kept. Returns its path. Creates the folder.
  //   throws  std::system_error
  std::string add(const nlohmann::ordered_json& capsule) const;  // NOLINT(modernize-use-nodiscard)
  // The paths of all capsules, in the order of add(); empty when there is no folder.
  //   throws  std::system_error when the folder cannot be read
  [[nodiscard]] std::vector<std::string> list() const;

 private:
  void prune(const std::string& newest) const;

  std::filesystem::path folder_;
  std::size_t maxFiles_;
  std::uint64_t maxBytes_;
};

}  // namespace mpf::crate
