// SPDX-License-Identifier: MIT
// Check of the connections to other hosts.
#include <fcntl.h>
#include <unistd.h>

#include <fmt/format.h>

#include <mpf/clock.h>
#include <mpf/file_descriptor.h>

#include "base/duration_text.h"
#include "shm/owner_lock.h"
#include "shm/segment_name.h"
#include "tools/doctor/checks.h"
#include "tools/report/router_view.h"
#include "tools/text/wrap.h"

namespace mpf::tools {
namespace {

// Longer than the restart of a router or a short network failure.
constexpr std::int64_t kLongNs = 60'000'000'000;

bool hasOwner(const std::filesystem::path& path, const SegmentImage& image) {
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  return file && owner_lock::isHeldByOwner(file.get(), image.header());
}

std::vector<RouterLineView> linesOf(const std::filesystem::path& path) try {
  const auto image = SegmentImage::tryReadFile(path.string());
  return image && hasOwner(path, *image) ? routerLines(*image, path.string())
                                         : std::vector<RouterLineView>();
} catch (const std::exception&) {
  return {};  // this user may not read the file; checkSegments() reports it
}

}  // namespace

Finding checkRouters(const Host& host) {
  constexpr const char* kName = "connections of routers";
  std::size_t remotes = 0;
  std::size_t callers = 0;
  std::size_t cut = 0;
  std::string longest;
  std::int64_t longestNs = 0;
  for (const auto& name : host.list("dev/shm")) {
    const auto parsed = SegmentName::tryParse(name);
    if (!parsed || parsed->kind != NameKind::router) continue;
    for (const auto& line : linesOf(host.root / "dev/shm" / name)) {
      ++(line.isClient() ? remotes : callers);
      const auto sinceNs = Clock::nowNs() - line.sinceNs;
      if (!line.isClient() || line.isConnected() || sinceNs < kLongNs) continue;
      ++cut;
      if (sinceNs <= longestNs) continue;
      longestNs = sinceNs;
      longest =
          fmt::format("{}, for {}: {}", line.address, durationText(static_cast<double>(sinceNs)),
                      line.problem.empty() ? "the reason is not known" : line.problem);
    }
  }
  if (remotes + callers == 0) return {kName, Health::ok, "none", {}};
  if (cut == 0)
    return {kName,
            Health::ok,
            fmt::format("{}, {}", counted(remotes, "remote"), counted(callers, "caller")),
            {}};
  return {kName, Health::warning,
          fmt::format("{} of {} cannot be reached: {}", cut, counted(remotes, "remote"), longest),
          "check that mpf-router runs there and listens on that address, and that the network and "
          "firewalls let connections through; `mpf mrr` shows each connection"};
}

}  // namespace mpf::tools
