// SPDX-License-Identifier: MIT
// TemporaryFolder: a folder of the test, which the destructor removes with all its files.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <string>

#include "base/system_call.h"

namespace mpf::test {

class TemporaryFolder {
 public:
  //   parent  with a slash at its end
  explicit TemporaryFolder(const std::string& parent = testing::TempDir()) {
    // mkdtemp() replaces the last six characters.
    std::string name = parent + "mpf-test-" + std::string(6, 'X');
    if (::mkdtemp(name.data()) == nullptr) throwSystemError(errno, "mkdtemp", name);
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  // The path of the file `name` in it.
  [[nodiscard]] std::string file(const std::string& name) const { return (path_ / name).string(); }
  // Creates the file `name` with this text.
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(file(name)) << text;
    return file(name);
  }

 private:
  std::filesystem::path path_;
};

}  // namespace mpf::test
