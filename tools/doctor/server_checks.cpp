// SPDX-License-Identifier: MIT
// Check of running servers: whether they can accept more clients.
#include <fcntl.h>

#include <fmt/format.h>

#include <mpf/file_descriptor.h>

#include "base/number.h"
#include "shm/owner_lock.h"
#include "shm/segment.h"
#include "shm/segment_name.h"
#include "shm/shortage.h"
#include "tools/doctor/checks.h"
#include "tools/inspect/segment_image.h"
#include "tools/text/wrap.h"

namespace mpf::tools {
namespace {

constexpr std::uint64_t kFilesOfAClient = 3;  // at most, while the server accepts it

struct OpenFiles {
  std::uint64_t used = 0, limit = 0;
  // At least 95 % of the limit is in use.
  [[nodiscard]] bool isNearlyFull() const noexcept {
    return limit != 0 && used + limit / 20 >= limit;
  }
};

// The open files of a process; zeros where /proc does not show them to this user.
OpenFiles openFilesOf(const Host& host, std::int32_t pid) {
  OpenFiles files;
  files.used = host.list(fmt::format("proc/{}/fd", pid)).size();
  if (files.used == 0) return {};
  constexpr std::string_view kLine = "Max open files";
  for (const auto& line : host.tryReadLines(fmt::format("proc/{}/limits", pid))) {
    const auto from = line.find_first_not_of(' ', kLine.size());
    if (!line.starts_with(kLine) || from == std::string::npos) continue;
    auto limit = std::string_view(line).substr(from);
    files.limit = tryTakeNumber<std::uint64_t>(limit).value_or(files.limit);
  }
  return files;
}

struct Problem {
  std::string seen, remedy;
};

// Why a server cannot accept more clients, or soon cannot; nullopt when it can.
std::optional<Problem> tryProblemOf(const Host& host, const layout::SegmentHeader& header,
                                    const layout::WindowControl& control) {
  const auto server = fmt::format("\"{}\" (pid {})", segments::text(header.name), header.ownerPid);
  const auto shortage = control.shortage.load(std::memory_order_relaxed);
  const auto [lack, remedy] = textOf(shortage);
  const auto files = openFilesOf(host, header.ownerPid);
  // A server clears its shortage only when it accepts the next client, which may never come.
  const bool isOver = shortage == layout::Shortage::descriptors && files.used != 0 &&
                      files.used + kFilesOfAClient < files.limit;
  if (*lack != '\0' && !isOver)
    return Problem{fmt::format("{} refuses clients: {}", server, lack), remedy};
  if (!files.isNearlyFull()) return std::nullopt;
  return Problem{fmt::format("{} has {} of {} files open", server, files.used, files.limit),
                 textOf(layout::Shortage::descriptors).remedy};
}

// A server window whose owner is alive; nullopt when the file is something else or this user may
// not read it.
std::optional<SegmentImage> livingServer(const std::filesystem::path& path) try {
  auto image = SegmentImage::tryReadFile(path.string());
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (!image || !file || image->header().kind != layout::SegmentKind::serverWindow)
    return std::nullopt;
  if (!owner_lock::isHeldByOwner(file.get(), image->header())) return std::nullopt;
  return image;
} catch (const std::exception&) {
  return std::nullopt;
}

}  // namespace

Finding checkServers(const Host& host) {
  constexpr const char* kName = "open files of servers";
  std::size_t servers = 0;
  std::vector<Problem> problems;
  for (const auto& name : host.list("dev/shm")) {
    const auto parsed = SegmentName::tryParse(name);
    if (!parsed || parsed->kind != NameKind::serverWindow) continue;
    const auto image = livingServer(host.root / "dev/shm" / name);
    if (!image) continue;
    ++servers;
    if (auto problem = tryProblemOf(host, image->header(), image->window()))
      problems.push_back(std::move(*problem));
  }
  if (servers == 0) return {kName, Health::ok, "no server is running", {}};
  if (problems.empty()) return {kName, Health::ok, counted(servers, "server"), {}};
  auto [seen, remedy] = problems.front();
  if (problems.size() > 1) seen += fmt::format("; and {} more", problems.size() - 1);
  return {kName, Health::problem, seen, remedy};
}

}  // namespace mpf::tools
