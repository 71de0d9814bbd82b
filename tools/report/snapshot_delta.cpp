// SPDX-License-Identifier: MIT
#include "tools/report/snapshot_delta.h"

#include <algorithm>
#include <fmt/format.h>
#include <thread>

#include <mpf/message_layout.h>
#include <mpf/message_types.h>

#include "base/duration_text.h"
#include "base/process_stat.h"

namespace mpf::tools {
namespace {

double perSecond(std::uint64_t messages, std::int64_t ns) noexcept {
  return ns > 0 ? static_cast<double>(messages) * 1e9 / static_cast<double>(ns) : 0;
}

std::uint64_t grown(std::uint64_t was, std::uint64_t is) noexcept {
  return is > was ? is - was : 0;
}

// The window of a client does not count the messages that it sends, but its links do. A link that
// was created between the snapshots started at 0.
std::uint64_t sentBetween(const WindowView& was, const WindowView& is) {
  std::unordered_map<std::uint64_t, std::uint64_t> before;
  for (const auto& link : was.links) before.emplace(link.incarnation, link.requests.sent);
  std::uint64_t sent = 0;
  for (const auto& link : is.links) {
    const auto found = before.find(link.incarnation);
    sent += link.requests.sent -
            (found == before.end() ? 0 : std::min(found->second, link.requests.sent));
  }
  return sent;
}

Rates ratesBetween(std::uint64_t sentBefore, std::uint64_t sent, std::uint64_t receivedBefore,
                   std::uint64_t received, std::int64_t ns) {
  return {perSecond(grown(sentBefore, sent), ns), perSecond(grown(receivedBefore, received), ns)};
}

// The row of the same connection in an older snapshot. A row is reused when its connection has
// ended, so role and address must agree.
const RouterLineView* findLine(const Snapshot& snapshot, std::uint64_t router,
                               const RouterLineView& line) {
  const auto found = std::ranges::find(snapshot.routers, router, &RouterView::incarnation);
  if (found == snapshot.routers.end()) return nullptr;
  const auto was = std::ranges::find(found->lines, line.row, &RouterLineView::row);
  return was != found->lines.end() && was->role == line.role && was->address == line.address
             ? &*was
             : nullptr;
}

Snapshot snapshotAfter(const std::string& backplane, Nanoseconds interval) {
  std::this_thread::sleep_for(interval);
  return Snapshot::take(backplane);
}

}  // namespace

Totals Totals::of(const WindowView& window) noexcept {
  Totals totals;
  for (const auto& link : window.links) {
    auto& requests = window.isServer ? totals.incoming : totals.outgoing;
    auto& replies = window.isServer ? totals.outgoing : totals.incoming;
    requests.sent += link.requests.sent;
    requests.taken += link.requests.taken;
    replies.sent += link.replies.sent;
    replies.taken += link.replies.taken;
    totals.refused += link.refused;
    totals.unanswered += link.unanswered;
    totals.bytes += link.bytes;
  }
  return totals;
}

SnapshotDelta::SnapshotDelta(const std::string& backplane, Nanoseconds interval)
    // Braces, so that the arguments are evaluated from left to right.
    : SnapshotDelta{Snapshot::take(backplane), snapshotAfter(backplane, interval)} {}

SnapshotDelta::SnapshotDelta(Snapshot before, Snapshot now)
    : before_(std::move(before)),
      now_(std::move(now)),
      windowsBefore_(windowsOf(before_)),
      windowsNow_(windowsOf(now_)) {
  for (const auto& server : before_.servers) {
    for (const auto& link : server.links) linksBefore_.emplace(link.incarnation, &link);
  }
}

SnapshotDelta::Windows SnapshotDelta::windowsOf(const Snapshot& snapshot) {
  Windows windows;
  for (const auto& server : snapshot.servers) windows.emplace(server.incarnation, &server);
  for (const auto& client : snapshot.clients) windows.emplace(client.incarnation, &client);
  return windows;
}

const WindowView* SnapshotDelta::find(std::uint64_t incarnation) const {
  const auto found = windowsNow_.find(incarnation);
  return found == windowsNow_.end() ? nullptr : found->second;
}

const WindowView* SnapshotDelta::before(const WindowView& window) const {
  const auto found = windowsBefore_.find(window.incarnation);
  return found == windowsBefore_.end() ? nullptr : found->second;
}

Rates SnapshotDelta::ratesOf(const WindowView& window) const {
  const auto* was = before(window);
  if (was == nullptr) return {};
  const auto ns = now_.atNs - before_.atNs;
  const auto sent = window.isServer ? grown(was->sent, window.sent) : sentBetween(*was, window);
  return {perSecond(sent, ns), perSecond(grown(was->received, window.received), ns)};
}

Rates SnapshotDelta::ratesOf(const LinkView& link) const {
  const auto found = linksBefore_.find(link.incarnation);
  if (found == linksBefore_.end()) return {};
  const auto ns = now_.atNs - before_.atNs;
  return {perSecond(grown(found->second->requests.sent, link.requests.sent), ns),
          perSecond(grown(found->second->replies.sent, link.replies.sent), ns)};
}

LineRates SnapshotDelta::ratesOf(const RouterView& router, const RouterLineView& line) const {
  const auto* was = findLine(before_, router.incarnation, line);
  if (was == nullptr) return {};
  const auto ns = now_.atNs - before_.atNs;
  return {
      ratesBetween(was->messagesSent, line.messagesSent, was->messagesReceived,
                   line.messagesReceived, ns),
      ratesBetween(was->framesSent, line.framesSent, was->framesReceived, line.framesReceived, ns),
      ratesBetween(was->bytesSent, line.bytesSent, was->bytesReceived, line.bytesReceived, ns)};
}

bool SnapshotDelta::isStalled(const WindowView& window) const {
  const auto* was = before(window);
  return was != nullptr && was->received == window.received &&
         Totals::of(*was).incoming.waiting() != 0 && Totals::of(window).incoming.waiting() != 0;
}

bool SnapshotDelta::isBusy(const WindowView& window) const {
  const auto* was = before(window);
  return window.life == Life::alive && !isStopped(window.processState) && was != nullptr &&
         was->received == window.received && was->handling && window.handling;
}

std::string SnapshotDelta::workOf(const WindowView& window) const {
  if (!isBusy(window)) return {};
  return workText(*window.handling, std::max<std::int64_t>(now_.atNs - window.progressAtNs, 0));
}

std::string SnapshotDelta::stateOf(const WindowView& window) const {
  if (window.life == Life::dead) return "dead";
  if (isStopped(window.processState)) return "stopped";
  if (window.life == Life::closed) return "closed";
  if (isBusy(window)) return "busy";
  return isStalled(window) ? "stalled" : "alive";
}

std::string SnapshotDelta::stateOf(const RouterView& router) const {
  if (router.life == Life::dead) return "dead";
  return isStopped(router.processState) ? "stopped" : "alive";
}

std::string SnapshotDelta::stateOf(const RouterView& router, const RouterLineView& line) const {
  auto state = stateOf(router);
  return state == "alive" ? toString(line.state) : state;
}

SnapshotDelta::RouterLineOf SnapshotDelta::routerOf(const WindowView& window) const {
  if (window.router == 0) return {};
  const auto router = std::ranges::find(now_.routers, window.router, &RouterView::incarnation);
  if (router == now_.routers.end()) return {};
  const auto line = std::ranges::find(router->lines, window.routerRow, &RouterLineView::row);
  return line == router->lines.end() ? RouterLineOf() : RouterLineOf{&*router, &*line};
}

std::string workText(const Handling& handling, std::int64_t forNs) {
  return fmt::format("{} cmd={} for {}", toString(static_cast<MessageType>(handling.type)),
                     handling.cmd, durationText(static_cast<double>(forNs)));
}

Latencies between(const Latencies& was, const Latencies& is) noexcept {
  Latencies sampled;
  for (std::size_t i = 0; i < is.buckets.size(); ++i) {
    sampled.buckets[i] = grown(was.buckets[i], is.buckets[i]);
    sampled.count += sampled.buckets[i];
  }
  sampled.maxNs = is.maxNs;
  return sampled;
}

}  // namespace mpf::tools
