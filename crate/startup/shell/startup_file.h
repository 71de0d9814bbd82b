// SPDX-License-Identifier: MIT
// StartupFile: the lines of a startup file, which are text and of limited size.
//
// Threads  any.
// Trust    a file may contain anything.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace mpf::startup {

struct StartupFile {
  std::string content;
  std::vector<std::string_view> lines;  // of the content, without their line ends

  // Reads a file whose lines end with LF or CRLF.
  //   throws  std::runtime_error that says why the file cannot be executed
  static StartupFile read(const std::filesystem::path& path);
  static StartupFile ofContent(std::string content);

  StartupFile(StartupFile&&) = delete;  // the lines refer to the content

 private:
  explicit StartupFile(std::string text);
};

// Whether every site generates a file of this name, or has its own, so that it is not beside its
// startup file elsewhere: cdCommands, envPaths, nfsCommands.
[[nodiscard]] bool isFileOfSite(const std::filesystem::path& path);

}  // namespace mpf::startup
