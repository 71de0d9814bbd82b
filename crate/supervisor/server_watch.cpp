// SPDX-License-Identifier: MIT
#include "crate/supervisor/server_watch.h"

#include <algorithm>

#include "base/process_stat.h"
#include "shm/stale_segments.h"

namespace mpf::crate {

using tools::Life;
using tools::Totals;
using tools::WindowView;

namespace {

// Whether a server has accepted no client and received no message since it was looked at before,
// although some wait. A server that works on one request for a long time is busy, not stalled; a
// stopped process does not work.
bool takesNothing(const WindowView& was, const WindowView& is) {
  if (is.handling && !isStopped(is.processState)) return false;
  const auto isWaiting = [](const WindowView& window) {
    return Totals::of(window).incoming.waiting() != 0 || !window.hints.knocks.empty();
  };
  return was.received == is.received && was.linksOpened == is.linksOpened && isWaiting(was) &&
         isWaiting(is);
}

}  // namespace

void ServerWatch::look() {
  before_ = std::move(now_);
  now_ = tools::Snapshot::take(backplane_);
  std::map<std::uint64_t, Begin> begins;
  for (const auto& window : now_->servers) {
    if (!window.handling || window.life != Life::alive || isStopped(window.processState)) continue;
    const auto was = begins_.find(window.incarnation);
    const auto isSame = was != begins_.end() && was->second.received == window.received;
    begins[window.incarnation] = isSame ? was->second : Begin{window.received, now_->atNs};
  }
  begins_ = std::move(begins);
}

std::vector<std::string> ServerWatch::notServing(pid_t pid, std::int32_t location,
                                                 const std::vector<std::string>& servers) const {
  auto missing = servers;
  std::erase_if(missing, [&](const std::string& name) {
    return now_ && std::ranges::any_of(now_->servers, [&](const WindowView& window) {
             return window.pid == pid && window.life == Life::alive && window.name == name &&
                    window.location == location;
           });
  });
  return missing;
}

bool ServerWatch::isStalled(pid_t pid) const {
  if (!before_ || !now_) return false;
  return std::ranges::any_of(now_->servers, [&](const WindowView& window) {
    const auto was =
        std::ranges::find(before_->servers, window.incarnation, &WindowView::incarnation);
    return window.pid == pid && window.life == Life::alive && was != before_->servers.end() &&
           takesNothing(*was, window);
  });
}

std::optional<Work> ServerWatch::workOf(pid_t pid) const {
  std::optional<Work> longest;
  if (!now_) return longest;
  for (const auto& window : now_->servers) {
    const auto begin = begins_.find(window.incarnation);
    if (window.pid != pid || begin == begins_.end()) continue;
    const auto forNs = now_->atNs - begin->second.atNs;
    if (forNs > (longest ? longest->forNs : 0)) longest = {window.name, *window.handling, forNs};
  }
  return longest;
}

void ServerWatch::removeFilesOfDead() const {
  for (const auto& file : stale_segments::judge(backplane_))
    if (file.verdict == stale_segments::Verdict::dead) stale_segments::tryRemove(file);
}

}  // namespace mpf::crate
