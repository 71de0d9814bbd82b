// SPDX-License-Identifier: MIT
#include <mpf/tools/look.h>

#include <algorithm>
#include <thread>

namespace mpf::tools {
namespace {

double perSecond(std::uint64_t messages, std::int64_t ns) noexcept {
  return ns > 0 ? static_cast<double>(messages) * 1e9 / static_cast<double>(ns) : 0;
}

std::uint64_t grown(std::uint64_t was, std::uint64_t is) noexcept { return is > was ? is - was : 0; }

// A client's window does not count what it sends, its links do. A link that came between the surveys started with nothing.
std::uint64_t sentBetween(const WindowView& was, const WindowView& is) {
  std::unordered_map<std::uint64_t, std::uint64_t> before;
  for (const auto& link : was.links) before.emplace(link.incarnation, link.requests.sent);
  std::uint64_t sent = 0;
  for (const auto& link : is.links) {
    const auto found = before.find(link.incarnation);
    sent += link.requests.sent - (found == before.end() ? 0 : std::min(found->second, link.requests.sent));
  }
  return sent;
}

Survey surveyAfter(const std::string& backplane, std::chrono::milliseconds interval) {
  std::this_thread::sleep_for(interval);
  return Survey::take(backplane);
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

Look::Look(const std::string& backplane, std::chrono::milliseconds interval)
    : Look{Survey::take(backplane), surveyAfter(backplane, interval)} {}  // braces: in this order

Look::Look(Survey before, Survey now)
    : before_(std::move(before)), now_(std::move(now)), windowsBefore_(windowsOf(before_)), windowsNow_(windowsOf(now_)) {
  for (const auto& server : before_.servers) {
    for (const auto& link : server.links) linksBefore_.emplace(link.incarnation, &link);
  }
}

Look::Windows Look::windowsOf(const Survey& survey) {
  Windows windows;
  for (const auto& server : survey.servers) windows.emplace(server.incarnation, &server);
  for (const auto& client : survey.clients) windows.emplace(client.incarnation, &client);
  return windows;
}

const WindowView* Look::find(std::uint64_t incarnation) const {
  const auto found = windowsNow_.find(incarnation);
  return found == windowsNow_.end() ? nullptr : found->second;
}

const WindowView* Look::before(const WindowView& window) const {
  const auto found = windowsBefore_.find(window.incarnation);
  return found == windowsBefore_.end() ? nullptr : found->second;
}

Rates Look::ratesOf(const WindowView& window) const {
  const auto* was = before(window);
  if (was == nullptr) return {};
  const auto ns = now_.atNs - before_.atNs;
  const auto sent = window.isServer ? grown(was->sent, window.sent) : sentBetween(*was, window);
  return {perSecond(sent, ns), perSecond(grown(was->received, window.received), ns)};
}

Rates Look::ratesOf(const LinkView& link) const {
  const auto found = linksBefore_.find(link.incarnation);
  if (found == linksBefore_.end()) return {};
  const auto ns = now_.atNs - before_.atNs;
  return {perSecond(grown(found->second->requests.sent, link.requests.sent), ns),
          perSecond(grown(found->second->replies.sent, link.replies.sent), ns)};
}

bool Look::isStalled(const WindowView& window) const {
  const auto* was = before(window);
  return was != nullptr && was->received == window.received && Totals::of(*was).incoming.waiting() != 0 &&
         Totals::of(window).incoming.waiting() != 0;
}

std::string Look::stateOf(const WindowView& window) const {
  if (window.life == Life::dead) return "dead";
  if (window.processState == 'T' || window.processState == 't') return "stopped";
  if (window.life == Life::closed) return "closed";
  return isStalled(window) ? "stalled" : "alive";
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
