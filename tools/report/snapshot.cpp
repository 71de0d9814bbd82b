// SPDX-License-Identifier: MIT
#include "tools/report/snapshot.h"

#include <sys/stat.h>

#include <algorithm>
#include <exception>
#include <map>
#include <unordered_map>

#include <mpf/clock.h>

#include "base/printable.h"
#include "base/saturating.h"
#include "shm/histogram.h"
#include "shm/segment.h"
#include "shm/segment_name.h"
#include "tools/inspect/segment_image.h"

namespace mpf::tools {
namespace {

constexpr std::size_t kLinkImageBytes = layout::kLinkControlOffset + sizeof(layout::LinkControl);

void checkIsFifo(const std::string& name) {
  struct stat status{};
  if (::lstat(segments::path(name).c_str(), &status) == 0 && !S_ISFIFO(status.st_mode)) {
    throw SegmentError(segments::path(name) + ": not the FIFO of a window");
  }
}

HintsView hintsOf(const layout::WindowHints& hints) {
  HintsView view;
  view.bell = value(hints.bell);
  view.isRescanDue = value(hints.rescan) != 0;
  for (const auto& knock : hints.knocks) {
    if (const auto link = value(knock); link != 0) view.knocks.push_back(link);
  }
  for (std::uint32_t index = 0; index < layout::kMaxLinks; ++index) {
    if ((value(hints.readyBits[index / 64]) >> index % 64 & 1u) != 0) view.ready.push_back(index);
  }
  return view;
}

Life lifeOf(const std::string& name, const SegmentImage& image) {
  if (segments::probeOwner(name, image.header().incarnation) != segments::Owner::alive)
    return Life::dead;
  return value(image.window().state) == layout::WindowState::closed ? Life::closed : Life::alive;
}

void copyCounters(const layout::WindowControl& from, WindowView& to) {
  to.received = value(from.received);
  to.sent = value(from.sent) + value(from.sentElsewhere);
  to.replyQueueFull = value(from.replyQueueFull);
  to.queueFull = value(from.queueFull);
  to.expired = value(from.expired);
  to.refused = value(from.refused);
  to.wakes = value(from.wakes);
  to.linksOpened = value(from.linksOpened);
  to.linksClosed = value(from.linksClosed);
  to.peersDied = value(from.peersDied);
  to.protocolErrors = value(from.protocolErrors);
  to.alarms = value(from.alarms);
  to.queueWait = Latencies::of(from.queueWaitNs);
  to.service = Latencies::of(from.serviceNs);
}

// Reads the segments of one backplane, one by one, into a Snapshot.
class SnapshotReader {
 public:
  explicit SnapshotReader(Snapshot& snapshot) : snapshot_(snapshot) {}

  void run() {
    for (const auto& name : segments::list(SegmentName::prefix(snapshot_.backplane))) {
      ++snapshot_.files;
      try {
        const auto parsed = SegmentName::tryParse(name);
        if (!parsed) throw SegmentError(segments::path(name) + ": not a name that MPF gives");
        look(name, *parsed);
      } catch (const std::exception& error) {
        snapshot_.problems.push_back(printable(error.what()));
      }
    }
    join();
    joinRouters();
    sort();
  }

 private:
  void look(const std::string& name, const SegmentName::Parsed& parsed) {
    switch (parsed.kind) {
      case NameKind::serverWindow:
        return window(name, layout::SegmentKind::serverWindow);
      case NameKind::clientWindow:
        return window(name, layout::SegmentKind::clientWindow);
      case NameKind::link:
        return link(name);
      case NameKind::pendingBind:
        return pendingBind(name);
      case NameKind::bulk:
        if (const auto image = read(name, layout::SegmentKind::bulk, layout::kHeaderBytes)) {
          bulkBytes_[parsed.incarnation] += image->fileBytes();
        }
        return;
      case NameKind::fanOut:
        if (const auto image = read(name, layout::SegmentKind::fanOut, layout::kHeaderBytes)) {
          fanOutBytes_[parsed.incarnation] += image->fileBytes();
        }
        return;
      case NameKind::hints:
        if (const auto image =
                read(name, layout::SegmentKind::hints, sizeof(layout::WindowHints))) {
          hints_.emplace(parsed.incarnation, hintsOf(image->hints()));
        }
        return;
      case NameKind::fifo:
        checkIsFifo(name);
        return;
      case NameKind::router:
        return router(name);
      case NameKind::reaper:  // exists for a moment only, and has no content
        return;
    }
  }

  std::optional<SegmentImage> read(const std::string& name, layout::SegmentKind kind,
                                   std::size_t bytes) {
    auto image = SegmentImage::tryRead(name, kind, bytes);
    if (image) snapshot_.bytes += image->fileBytes();
    return image;
  }

  void window(const std::string& name, layout::SegmentKind kind) {
    const auto image = read(name, kind, layout::kWindowBytes);
    if (!image) return;
    const auto& header = image->header();
    WindowView view;
    view.file = name;
    view.isServer = kind == layout::SegmentKind::serverWindow;
    view.incarnation = header.incarnation;
    view.program = segments::text(header.program);
    view.name = segments::text(header.name);
    if (view.name.empty()) view.name = view.program;
    view.location = header.location;
    view.pid = header.ownerPid;
    view.owner = Owner::of(header);
    view.waitMode = header.waitMode;
    view.life = lifeOf(name, *image);
    view.sleeping = value(image->window().sleeping);
    if (view.life != Life::dead) view.processState = processState(view.owner);
    view.ageNs = saturatingDifference(snapshot_.atNs, header.createdMonotonicNs);
    view.queueSize = view.isServer ? value(image->window().queueSize) : header.queueSize;
    view.maxMessageBytes = header.maxMessageBytes;
    copyCounters(image->window(), view);
    view.handling = Handling::of(value(image->window().handling));
    view.progressAtNs = static_cast<std::int64_t>(value(image->window().progressAtNs));
    (view.isServer ? snapshot_.servers : snapshot_.clients).push_back(std::move(view));
  }

  void link(const std::string& name) {
    const auto image = read(name, layout::SegmentKind::link, kLinkImageBytes);
    if (!image) return;
    const auto& header = image->header();
    const auto& control = image->link();
    LinkView view;
    view.file = name;
    view.incarnation = header.incarnation;
    view.serverWindow = header.serverWindow;
    view.clientWindow = header.clientWindow;
    view.server = segments::text(header.name);
    view.location = header.location;
    view.clientState = value(control.clientState);
    view.serverState = value(control.serverState);
    view.clientIndex = header.clientIndex;
    view.serverIndex = value(control.serverIndex);
    view.isPolledByClient = value(control.replyWatch) != layout::Watch::unwatched;
    view.isPolledByServer = value(control.requestWatch) != layout::Watch::unwatched;
    view.queueSize = header.queueSize;
    view.requests = {value(control.clientSent), value(control.requests.taken)};
    view.replies = {value(control.serverSent), value(control.replies.taken)};
    view.refused = value(control.clientRefused);
    const auto answered = value(control.clientAnswered);
    view.unanswered = view.requests.sent - std::min(view.requests.sent, answered);
    view.bytes = image->fileBytes();
    links_.push_back(std::move(view));
  }

  void pendingBind(const std::string& name) {
    const auto image = read(name, layout::SegmentKind::pendingBind, layout::kHeaderBytes);
    if (!image) return;
    snapshot_.pendingBinds.push_back({image->header().ownerWindow,
                                      segments::text(image->header().name),
                                      image->header().location});
  }

  void router(const std::string& name) {
    auto view = tryReadRouter(name);
    if (!view) return;
    snapshot_.bytes += view->bytes;
    snapshot_.routers.push_back(std::move(*view));
  }

  // Marks the windows that a router has here for servers and clients on other hosts.
  void joinRouters() {
    std::map<Owner, const RouterView*> routers;
    for (const auto& router : snapshot_.routers) routers.emplace(router.owner, &router);
    if (routers.empty()) return;
    for (auto* windows : {&snapshot_.servers, &snapshot_.clients}) {
      for (auto& window : *windows) {
        const auto router = routers.find(window.owner);
        if (router == routers.end()) continue;
        const auto* line = window.isServer ? router->second->lineTo(window.location)
                                           : router->second->lineFrom(window.name);
        if (line == nullptr) continue;
        window.router = router->second->incarnation;
        window.routerRow = line->row;
      }
    }
  }

  // Adds each link to both of its windows, and each pending bind to the window of its client. Links
  // whose windows no longer exist are about to be removed and are not shown.
  void join() {
    std::unordered_map<std::uint64_t, WindowView*> servers;
    std::unordered_map<std::uint64_t, WindowView*> clients;
    for (auto& server : snapshot_.servers) servers.emplace(server.incarnation, &server);
    for (auto& client : snapshot_.clients) clients.emplace(client.incarnation, &client);
    for (auto* windows : {&servers, &clients}) {
      for (auto& [incarnation, window] : *windows) {
        if (const auto hints = hints_.find(incarnation); hints != hints_.end())
          window->hints = hints->second;
        if (const auto pool = fanOutBytes_.find(incarnation); pool != fanOutBytes_.end())
          window->fanOutBytes = pool->second;
      }
    }
    for (auto& link : links_) {
      if (const auto bulk = bulkBytes_.find(link.incarnation); bulk != bulkBytes_.end())
        link.bytes += bulk->second;
      if (const auto server = servers.find(link.serverWindow); server != servers.end())
        server->second->links.push_back(link);
      if (const auto client = clients.find(link.clientWindow); client != clients.end())
        client->second->links.push_back(link);
    }
    std::ranges::sort(snapshot_.pendingBinds, {}, [](const PendingBindView& view) {
      return std::pair(view.location, view.server);
    });
    for (const auto& pendingBind : snapshot_.pendingBinds) {
      if (const auto client = clients.find(pendingBind.clientWindow); client != clients.end())
        client->second->pendingBinds.push_back(pendingBind);
    }
  }

  void sort() {
    std::ranges::sort(snapshot_.servers, {},
                      [](const WindowView& view) { return std::pair(view.location, view.name); });
    std::ranges::sort(snapshot_.clients, {}, [](const WindowView& view) {
      return std::pair(saturatingDifference(0, view.ageNs), view.incarnation);
    });
    std::ranges::sort(snapshot_.routers, {}, [](const RouterView& view) {
      return std::pair(view.name, view.incarnation);
    });
    const auto byServer = [](const LinkView& view) {
      return std::tuple(view.location, view.server, view.incarnation);
    };
    for (auto* windows : {&snapshot_.servers, &snapshot_.clients}) {
      for (auto& window : *windows) std::ranges::sort(window.links, {}, byServer);
    }
  }

  Snapshot& snapshot_;
  std::vector<LinkView> links_;
  std::unordered_map<std::uint64_t, std::uint64_t> bulkBytes_;  // by link
  std::unordered_map<std::uint64_t, std::uint64_t> fanOutBytes_;  // by window
  std::unordered_map<std::uint64_t, HintsView> hints_;  // by window
};

}  // namespace

const char* toString(layout::LinkState state) noexcept {
  switch (state) {
    case layout::LinkState::none:
      return "none";
    case layout::LinkState::open:
      return "open";
    case layout::LinkState::closed:
      return "closed";
    case layout::LinkState::refused:
      return "refused";
  }
  return "unknown";
}

const char* toString(layout::SleepState state) noexcept {
  switch (state) {
    case layout::SleepState::awake:
      return "awake";
    case layout::SleepState::onFutex:
      return "asleep on its futex";
    case layout::SleepState::onDescriptor:
      return "asleep on its pipe";
  }
  return "unknown";
}

const char* waitModeName(std::uint32_t mode) noexcept {
  constexpr std::array<const char*, 3> kNames{"spin", "adaptive", "block"};
  return mode < kNames.size() ? kNames[mode] : "unknown";
}

bool HintsView::isReady(std::uint32_t index) const noexcept {
  return std::ranges::binary_search(ready, index);
}

bool HintsView::hasKnocked(std::uint64_t link) const noexcept {
  return std::ranges::find(knocks, link) != knocks.end();
}

Latencies Latencies::of(const layout::Histogram& histogram) noexcept {
  Latencies latencies;
  for (std::size_t i = 0; i < latencies.buckets.size(); ++i) {
    latencies.buckets[i] = value(histogram.buckets[i]);
    latencies.count += latencies.buckets[i];
  }
  latencies.maxNs = value(histogram.maxNs);
  return latencies;
}

std::uint64_t Latencies::percentileNs(double percent) const noexcept {
  const auto wanted = static_cast<double>(count) * percent / 100;
  std::uint64_t seen = 0;
  for (std::uint32_t i = 0; i < layout::kHistogramBuckets; ++i) {
    seen += buckets[i];
    if (i + 1 == layout::kHistogramBuckets) break;  // the last bucket has no upper end
    if (seen != 0 && static_cast<double>(seen) >= wanted)
      return std::min(HistogramBuckets::endNs(i), maxNs);
  }
  return maxNs;
}

Snapshot Snapshot::take(const std::string& backplane) {
  SegmentName::checkBackplane(backplane);
  Snapshot snapshot;
  snapshot.backplane = backplane;
  snapshot.atNs = Clock::nowNs();
  SnapshotReader(snapshot).run();
  return snapshot;
}

}  // namespace mpf::tools
