// SPDX-License-Identifier: MIT
#include <mpf/tools/look.h>

#include <thread>

namespace mpf::tools {
namespace {

double perSecond(std::uint64_t before, std::uint64_t now, std::int64_t ns) noexcept {
  return now > before && ns > 0 ? static_cast<double>(now - before) * 1e9 / static_cast<double>(ns) : 0;
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
    : before_(Survey::take(backplane)), now_(surveyAfter(backplane, interval)) {}

Rates Look::ratesOf(const WindowView& window) const noexcept {
  const auto* before = before_.find(window.incarnation);
  if (before == nullptr) return {};
  const auto ns = now_.atNs - before_.atNs;
  const auto was = Totals::of(*before);
  const auto is = Totals::of(window);
  return {perSecond(was.outgoing.sent, is.outgoing.sent, ns), perSecond(was.incoming.taken, is.incoming.taken, ns)};
}

bool Look::isStalled(const WindowView& window) const noexcept {
  const auto* before = before_.find(window.incarnation);
  if (before == nullptr) return false;
  const auto was = Totals::of(*before);
  const auto is = Totals::of(window);
  return was.incoming.waiting() != 0 && is.incoming.waiting() != 0 && was.incoming.taken == is.incoming.taken;
}

std::string Look::stateOf(const WindowView& window) const {
  if (window.life == Life::dead) return "dead";
  if (window.processState == 'T' || window.processState == 't') return "stopped";
  if (window.life == Life::closed) return "closed";
  return isStalled(window) ? "stalled" : "alive";
}

}  // namespace mpf::tools
