// SPDX-License-Identifier: MIT
#include "crate/capsule/capsule_store.h"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <fmt/format.h>
#include <ranges>
#include <string_view>

#include <mpf/clock.h>

#include "base/number.h"
#include "base/output_file.h"
#include "base/system_call.h"

namespace mpf::crate {
namespace {

constexpr const char* kEnding = ".capsule.json";

// The number with which a name begins; 0: none.
std::uint64_t numberOf(const std::filesystem::path& path) {
  const auto name = path.filename().string();
  std::string_view text = name;
  return tryTakeNumber<std::uint64_t>(text).value_or(0);
}

// The time in nanoseconds; if the clock has been set back, a number above those of `paths`.
std::uint64_t freshNumber(const std::vector<std::string>& paths) {
  auto number = static_cast<std::uint64_t>(Clock::wallNs());
  for (const auto& path : paths) number = std::max(number, numberOf(path) + 1);
  return number;
}

// A name that sorts by the 20 digits of its number.
std::string nameOf(const nlohmann::ordered_json& capsule, std::uint64_t number) {
  std::string process = capsule.value("process", "");
  std::ranges::replace_if(process, [](char c) { return c == '/' || c == '\0'; }, '_');
  return fmt::format("{:020}-{}-{}{}", number, process.substr(0, 64), capsule.value("pid", 0),
                     kEnding);
}

}  // namespace

std::string CapsuleStore::add(const nlohmann::ordered_json& capsule) const {
  if (::mkdir(folder_.c_str(), 0700) != 0 && errno != EEXIST)
    throwSystemError(errno, "create", folder_.string());
  const auto path = (folder_ / nameOf(capsule, freshNumber(list()))).string();
  replaceFile(path, capsule.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n",
              0600);
  prune(path);
  return path;
}

std::vector<std::string> CapsuleStore::list() const {
  std::vector<std::string> paths;
  std::error_code failure;
  for (const auto& entry : std::filesystem::directory_iterator(folder_, failure)) {
    if (entry.path().filename().string().ends_with(kEnding)) paths.push_back(entry.path().string());
  }
  if (failure && failure.value() != ENOENT)
    throwSystemError(failure.value(), "list", folder_.string());
  std::ranges::sort(paths);
  return paths;
}

void CapsuleStore::prune(const std::string& newest) const {
  auto paths = list();
  // A file with a name of another form may sort behind it.
  std::ranges::stable_partition(paths, [&](const auto& path) { return path != newest; });
  std::uint64_t bytes = 0;
  std::size_t kept = 0;
  for (const auto& path : std::views::reverse(paths)) {
    std::error_code gone;
    const auto size = std::filesystem::file_size(path, gone);
    if (!gone) bytes += size;
    if (kept != 0 && (kept >= maxFiles_ || bytes > maxBytes_)) std::filesystem::remove(path, gone);
    else ++kept;
  }
}

}  // namespace mpf::crate
