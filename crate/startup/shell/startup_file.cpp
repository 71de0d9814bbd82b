// SPDX-License-Identifier: MIT
#include "crate/startup/shell/startup_file.h"

#include <algorithm>
#include <fmt/format.h>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "base/whole_file.h"
#include "crate/startup/shell/startup_shell.h"

namespace mpf::startup {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

}  // namespace

StartupFile StartupFile::ofContent(std::string content) {
  if (content.size() > StartupShell::Limits::kFileBytes)
    throw std::runtime_error(
        fmt::format("the file has more than {} MiB, so it is not a startup file",
                    StartupShell::Limits::kFileBytes >> 20));
  if (content.find('\0') != std::string::npos)
    throw std::runtime_error("the file contains null characters, so it is not a startup file");
  return StartupFile(std::move(content));
}

StartupFile StartupFile::read(const std::filesystem::path& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) throw std::runtime_error("the file does not exist");
  if (!std::filesystem::is_regular_file(status))
    throw std::runtime_error(std::filesystem::is_directory(status) ? "this is a folder"
                                                                   : "this is not a regular file");
  const auto bytes = std::filesystem::file_size(path, error);
  if (!error && bytes > StartupShell::Limits::kFileBytes)
    return ofContent(std::string(StartupShell::Limits::kFileBytes + 1, ' '));
  try {
    return ofContent(readWholeFile(path.string()));
  } catch (const std::system_error& failure) {
    throw std::runtime_error("the file cannot be read: " + failure.code().message());
  }
}

StartupFile::StartupFile(std::string text) : content(std::move(text)) {
  std::string_view rest = content;
  if (rest.starts_with(kByteOrderMark)) rest.remove_prefix(kByteOrderMark.size());
  while (!rest.empty()) {
    const auto end = std::min(rest.find('\n'), rest.size());
    auto line = rest.substr(0, end);
    if (line.ends_with('\r')) line.remove_suffix(1);
    lines.push_back(line);
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
}

bool isFileOfSite(const std::filesystem::path& path) {
  const auto name = path.filename().string();
  return name.starts_with("cdCommands") || name.starts_with("envPaths") ||
         name.starts_with("nfsCommands");
}

}  // namespace mpf::startup
