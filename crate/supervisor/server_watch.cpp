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

void ServerWatch::removeFilesOfDead() const {
  for (const auto& file : stale_segments::judge(backplane_))
    if (file.verdict == stale_segments::Verdict::dead) stale_segments::tryRemove(file);
}

}  // namespace mpf::crate
