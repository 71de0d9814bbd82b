// SPDX-License-Identifier: MIT
#include "tools/report/router_view.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>

#include <mpf/clock.h>
#include <mpf/file_descriptor.h>

#include "base/number.h"
#include "base/printable.h"
#include "base/process_stat.h"
#include "shm/process.h"
#include "shm/segment.h"

namespace mpf::tools {
namespace {

constexpr std::size_t kMaxReads = 1000;  // of a row whose texts keep changing

bool isUsed(const layout::RouterLine& line) noexcept {
  const auto role = value(line.role);
  return role == layout::RouterRole::client || role == layout::RouterRole::server;
}

bool sameTexts(const layout::RouterLine& a, const layout::RouterLine& b) noexcept {
  return a.address == b.address && a.peer == b.peer && a.program == b.program &&
         a.locations == b.locations && a.problem == b.problem;
}

// Whether the router wrote no text of the row between the copy `was` and the copy `is`.
bool isWhole(const layout::RouterLine& was, const layout::RouterLine& is) noexcept {
  const auto texts = value(was.texts);
  return texts % 2 == 0 && texts == value(is.texts) && sameTexts(was, is);
}

RouterLineView viewOf(const layout::RouterLine& line, std::size_t row) {
  RouterLineView view;
  view.row = row;
  view.role = value(line.role);
  view.state = value(line.state);
  view.isTls = value(line.isTls) != 0;
  view.sinceNs = static_cast<std::int64_t>(value(line.sinceNs));
  view.connects = value(line.connects);
  view.queueSize = value(line.queueSize);
  view.inQueue = value(line.inQueue);
  view.queueFull = value(line.queueFull);
  view.messagesSent = value(line.messagesSent);
  view.messagesReceived = value(line.messagesReceived);
  view.framesSent = value(line.framesSent);
  view.framesReceived = value(line.framesReceived);
  view.bytesSent = value(line.bytesSent);
  view.bytesReceived = value(line.bytesReceived);
  view.roundTripNs = value(line.roundTripNs);
  view.clients = value(line.clients);
  view.bindings = value(line.bindings);
  view.address = segments::text(line.address);
  view.peer = segments::text(line.peer);
  view.program = segments::text(line.program);
  view.locations = segments::text(line.locations);
  view.problem = segments::text(line.problem);
  return view;
}

// Copies the row until two successive copies have the same texts: then the router wrote no text in
// between. After kMaxReads copies it uses the last one. nullopt: the row is no longer in use.
std::optional<RouterLineView> readRow(int file, std::size_t row, const layout::RouterLine& first) {
  std::array<layout::RouterLine, 2> copies{};
  const auto* was = &first;
  for (std::size_t reads = 0; reads < kMaxReads; ++reads) {
    // PAIR(router-texts): if this copy contains a part of a text that was written after the
    // previous copy read the counter, the counters of the two copies differ.
    std::atomic_thread_fence(std::memory_order_acquire);
    auto& is = copies.at(reads % copies.size());
    const auto offset = layout::kRouterLinesOffset + row * sizeof is;
    if (::pread(file, &is, sizeof is, static_cast<off_t>(offset)) !=
        static_cast<ssize_t>(sizeof is))
      break;
    if (!isUsed(is)) return std::nullopt;
    if (isWhole(*was, is)) return viewOf(is, row);
    was = &is;
  }
  return viewOf(*was, row);
}

}  // namespace

char processState(const Owner& owner) {
  if (owner.pidNamespace != Process::self().pidNamespace) return '?';
  return ProcessStat::tryRead(owner.pid).value_or(ProcessStat()).state();
}

const char* toString(layout::RouterLineState state) noexcept {
  switch (state) {
    case layout::RouterLineState::none:
      return "none";
    case layout::RouterLineState::waiting:
      return "waiting";
    case layout::RouterLineState::connecting:
      return "connecting";
    case layout::RouterLineState::connected:
      return "connected";
  }
  return "unknown";
}

std::vector<std::int32_t> RouterLineView::locationList() const {
  std::vector<std::int32_t> list;
  std::string_view rest = locations;
  while (!rest.empty()) {
    const auto number = tryTakeNumber<std::int32_t>(rest);
    if (number && (rest.empty() || rest.starts_with(','))) list.push_back(*number);
    rest.remove_prefix(std::min(rest.find(','), rest.size()));
    rest.remove_prefix(std::min(rest.find_first_not_of(", "), rest.size()));
  }
  return list;
}

// A list of locations that fills its field may have been cut off. If there is only one remote, it
// must be the one for the locations that are missing in the list.
const RouterLineView* RouterView::lineTo(std::int32_t location) const {
  const auto reaches = [&](const RouterLineView& line) {
    const auto list = line.locationList();
    return line.isClient() && std::ranges::find(list, location) != list.end();
  };
  if (const auto found = std::ranges::find_if(lines, reaches); found != lines.end()) return &*found;
  const auto remotes = std::ranges::count_if(lines, &RouterLineView::isClient);
  const bool isCut =
      remotes == 1 && lines.front().locations.size() == sizeof(layout::RouterLine::locations) - 1;
  return isCut ? &lines.front() : nullptr;
}

const RouterLineView* RouterView::lineFrom(const std::string& label) const {
  const RouterLineView* found = nullptr;
  for (const auto& line : lines) {
    if (line.isClient() || line.peer.empty()) continue;
    // The label may be cut inside a UTF-8 character; printable() treats both texts alike.
    if (printable(("router " + line.peer).substr(0, layout::kNameChars - 1)) != label) continue;
    if (found != nullptr) return nullptr;
    found = &line;
  }
  return found;
}

std::vector<RouterLineView> routerLines(const SegmentImage& image, const std::string& path) {
  std::vector<RouterLineView> lines;
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  std::size_t row = 0;
  for (const auto& line : image.routerLines()) {
    if (auto view = isUsed(line) ? readRow(file.get(), row, line) : std::nullopt)
      lines.push_back(std::move(*view));
    ++row;
  }
  std::ranges::stable_partition(lines, [](const RouterLineView& line) { return line.isClient(); });
  return lines;
}

std::optional<RouterView> tryReadRouter(const std::string& name) {
  const auto image = SegmentImage::tryRead(name, layout::SegmentKind::router, layout::kRouterBytes);
  if (!image) return std::nullopt;
  const auto& header = image->header();
  RouterView view;
  view.file = name;
  view.incarnation = header.incarnation;
  view.name = segments::text(header.name);
  view.program = segments::text(header.program);
  view.owner = Owner::of(header);
  view.life = segments::probeOwner(name, header.incarnation) == segments::Owner::alive ? Life::alive
                                                                                       : Life::dead;
  if (view.life != Life::dead) view.processState = processState(view.owner);
  view.ageNs = Clock::nowNs() - header.createdMonotonicNs;
  view.bytes = image->fileBytes();
  view.lines = routerLines(*image, segments::path(name));
  return view;
}

}  // namespace mpf::tools
