// SPDX-License-Identifier: MIT
#include "tools/torture/checks.h"

#include <algorithm>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <set>

#include "shm/segment.h"
#include "shm/segment_name.h"
#include "tools/report/snapshot.h"

namespace mpf::torture {
namespace {

struct Living {
  std::set<std::uint64_t> windows;
  std::set<std::uint64_t> links;
};

// Incarnation of the window that owns a segment; 0 when the segment no longer exists or cannot be
// read.
std::uint64_t ownerOf(const std::string& name, layout::SegmentKind kind) try {
  const auto segment = Segment::tryOpen(name, kind, Segment::Access::readOnly);
  return segment ? segment->header().ownerWindow : 0;
} catch (const SegmentError&) {
  return 0;
}

bool isLivingWindow(const std::string& name, NameKind kind, Living& living) {
  const bool isServer = kind == NameKind::serverWindow;
  if (segments::probeOwner(name) != segments::Owner::alive) return false;
  living.windows.insert(ownerOf(
      name, isServer ? layout::SegmentKind::serverWindow : layout::SegmentKind::clientWindow));
  return true;
}

// Whether a segment belongs to a living process. Called for windows before links, and for links
// before bulk segments.
bool belongs(const std::string& name, const SegmentName::Parsed& parsed, Living& living) {
  switch (parsed.kind) {
    case NameKind::serverWindow:
    case NameKind::clientWindow:
      return isLivingWindow(name, parsed.kind, living);
    case NameKind::hints:
    case NameKind::fifo:
    case NameKind::fanOut:
      return living.windows.contains(parsed.incarnation);
    case NameKind::router:
    case NameKind::reaper:
      return segments::probeOwner(name) == segments::Owner::alive;
    case NameKind::pendingBind:
      return living.windows.contains(ownerOf(name, layout::SegmentKind::pendingBind));
    case NameKind::link:
      if (!living.windows.contains(parsed.serverWindow)) return false;
      if (!living.windows.contains(ownerOf(name, layout::SegmentKind::link))) return false;
      living.links.insert(parsed.incarnation);
      return true;
    case NameKind::bulk:
      return living.links.contains(parsed.incarnation);
  }
  return false;
}

int rank(NameKind kind) {
  if (kind == NameKind::serverWindow || kind == NameKind::clientWindow) return 0;
  return kind == NameKind::bulk ? 2 : 1;
}

// The window of a server; an empty view if it has no window.
tools::WindowView viewOf(const std::string& backplane, const std::string& server) {
  const auto snapshot = tools::Snapshot::take(backplane);
  const auto found = std::ranges::find(snapshot.servers, server, &tools::WindowView::name);
  return found == snapshot.servers.end() ? tools::WindowView() : *found;
}

// The number after a word in a file of /proc; 0 when the word is missing.
std::size_t numberIn(const std::string& path, const std::string& word) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with(word)) return std::stoul(line.substr(word.size()));
  }
  return 0;
}

}  // namespace

std::vector<std::string> staleSegments(const std::string& backplane, std::size_t links) {
  std::vector<std::pair<std::string, SegmentName::Parsed>> names;
  for (auto& name : segments::list(SegmentName::prefix(backplane))) {
    if (auto parsed = SegmentName::tryParse(name))
      names.emplace_back(std::move(name), std::move(*parsed));
  }
  std::ranges::stable_sort(names, {}, [](const auto& name) { return rank(name.second.kind); });
  Living living;
  std::vector<std::string> stale;
  for (const auto& [name, parsed] : names) {
    if (!belongs(name, parsed, living)) stale.push_back(name);
  }
  if (living.links.size() > links)
    stale.push_back(fmt::format("{} links where {} are connected", living.links.size(), links));
  return stale;
}

std::uint64_t incarnationOf(const std::string& backplane, const std::string& server) {
  return ownerOf(SegmentName::serverWindow(backplane, 0, server),
                 layout::SegmentKind::serverWindow);
}

void checkNoProtocolErrors(const std::string& backplane) {
  const auto snapshot = tools::Snapshot::take(backplane);
  for (const auto* windows : {&snapshot.servers, &snapshot.clients}) {
    for (const auto& window : *windows) {
      if (window.protocolErrors != 0)
        throw Broken(fmt::format("{} received invalid data from a peer", window.name));
    }
  }
}

std::uint64_t openLinks(const std::string& backplane, const std::string& server) {
  const auto window = viewOf(backplane, server);
  return window.linksOpened - window.linksClosed;
}

std::uint64_t clientsDied(const std::string& backplane, const std::string& server) {
  return viewOf(backplane, server).peersDied;
}

Holdings Holdings::of(pid_t pid) {
  const auto directory = fmt::format("/proc/{}", pid);
  Holdings holdings;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(directory + "/fd"))
    ++holdings.descriptors;
  std::ifstream maps(directory + "/maps");
  for (std::string line; std::getline(maps, line);) {
    if (line.find(" /dev/shm/") != std::string::npos) ++holdings.mappings;
  }
  holdings.heapKiB = numberIn(directory + "/status", "RssAnon:");
  return holdings;
}

}  // namespace mpf::torture
