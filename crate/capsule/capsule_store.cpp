// SPDX-License-Identifier: MIT
#include "crate/capsule/capsule_store.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <fmt/format.h>

#include <mpf/clock.h>

#include "base/output_file.h"
#include "base/system_call.h"

namespace mpf::crate {
namespace {

constexpr const char* kEnding = ".capsule.json";

// A name that sorts by time: 20 digits of nanoseconds.
std::string freshName(const nlohmann::ordered_json& capsule) {
  std::string process = capsule.value("process", "");
  std::ranges::replace_if(process, [](char c) { return c == '/' || c == '\0'; }, '_');
  return fmt::format("{:020}-{}-{}{}", Clock::wallNs(), process.substr(0, 64),
                     capsule.value("pid", 0), kEnding);
}

// Writes a file that gets its name when it is complete. After a failure its part is removed: on a
// full disk, parts would take the space that becomes free.
void writeWhole(const std::string& path, const std::string& text) {
  const auto fresh = path + ".new";
  try {
    OutputFile file(fresh, 0600);
    file.write(text);
    file.close();
    checkCall(std::rename(fresh.c_str(), path.c_str()), "rename", path);
  } catch (...) {
    ::unlink(fresh.c_str());
    throw;
  }
}

}  // namespace

std::string CapsuleStore::add(const nlohmann::ordered_json& capsule) const {
  if (::mkdir(folder_.c_str(), 0700) != 0 && errno != EEXIST)
    throwSystemError(errno, "create", folder_.string());
  const auto path = (folder_ / freshName(capsule)).string();
  writeWhole(path, capsule.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
  prune();
  return path;
}

std::vector<std::string> CapsuleStore::list() const {
  std::vector<std::string> paths;
  std::error_code absent;
  for (const auto& entry : std::filesystem::directory_iterator(folder_, absent)) {
    if (entry.path().filename().string().ends_with(kEnding)) paths.push_back(entry.path().string());
  }
  std::ranges::sort(paths);
  return paths;
}

void CapsuleStore::prune() const {
  const auto paths = list();
  std::uint64_t bytes = 0;
  std::size_t kept = 0;
  for (auto path = paths.rbegin(); path != paths.rend(); ++path) {
    std::error_code gone;
    const auto size = std::filesystem::file_size(*path, gone);
    if (!gone) bytes += size;
    if (kept != 0 && (kept >= maxFiles_ || bytes > maxBytes_)) std::filesystem::remove(*path, gone);
    else ++kept;
  }
}

}  // namespace mpf::crate
