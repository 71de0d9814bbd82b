// SPDX-License-Identifier: MIT
#include "tools/tap/tap_session.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "shm/segment_name.h"
#include "tools/inspect/dissect.h"
#include "tools/inspect/segment_image.h"

namespace mpf::tools {
namespace {

constexpr auto kLookEvery = std::chrono::milliseconds(200);

TappedLink describe(const std::string& backplane, const layout::SegmentHeader& header) {
  TappedLink link;
  link.incarnation = header.incarnation;
  link.server = segments::rawText(header.name);
  link.location = header.location;
  const auto name = SegmentName::keyed(backplane, NameKind::clientWindow, header.clientWindow);
  const auto client =
      SegmentImage::tryRead(name, layout::SegmentKind::clientWindow, layout::kHeaderBytes);
  if (!client) return link;
  link.client = segments::rawText(client->header().name);
  if (link.client.empty()) link.client = segments::rawText(client->header().program);
  link.clientPid = client->header().ownerPid;
  return link;
}

}  // namespace

TapSession::TapSession(TapSelection selection, TapSink& sink)
    : selection_(std::move(selection)),
      sink_(sink),
      window_(
          SegmentName::serverWindow(selection_.backplane, selection_.location, selection_.server)) {
  SegmentName::checkBackplane(selection_.backplane);
  SegmentName::checkServer(selection_.server);
  lookAtNames(FollowFrom::newest);
}

bool TapSession::isWanted(const std::string& name) const {
  const auto parsed = SegmentName::tryParse(name);
  return parsed && parsed->kind == NameKind::link && parsed->backplane == selection_.backplane &&
         parsed->serverWindow == incarnation_ &&
         hex(parsed->incarnation).starts_with(selection_.link);
}

// Looks at all names: at the start, when the server has appeared, and every kLookEvery to find
// links that were removed.
void TapSession::lookAtNames(FollowFrom from) {
  lookAgain_ = Deadline::after(kLookEvery);
  const auto image =
      SegmentImage::tryRead(window_, layout::SegmentKind::serverWindow, layout::kHeaderBytes);
  incarnation_ = image ? image->header().incarnation : 0;
  const auto names = segments::list(SegmentName::prefix(selection_.backplane));
  dropEnded({names.begin(), names.end()});
  for (const auto& name : names) {
    if (isWanted(name)) follow(name, from);
  }
}

void TapSession::lookAtNew(const std::vector<std::string>& names) {
  if (std::ranges::find(names, window_) != names.end()) return lookAtNames(FollowFrom::first);
  for (const auto& name : names) {
    if (isWanted(name)) follow(name, FollowFrom::first);
  }
}

void TapSession::dropEnded(const std::set<std::string>& there) {
  for (auto entry = followed_.begin(); entry != followed_.end();) {
    auto& [name, followed] = *entry;
    if (there.contains(name) && !followed.follower->isOver()) {
      ++entry;
      continue;
    }
    close(followed);
    if (there.contains(name)) notFollowed_.insert(name);
    entry = followed_.erase(entry);
  }
  std::erase_if(notFollowed_, [&](const std::string& name) { return !there.contains(name); });
}

void TapSession::follow(const std::string& name, FollowFrom from) {
  if (followed_.contains(name) || notFollowed_.contains(name)) return;
  auto followed = tryOpen(name, from);
  if (!followed) return;
  sink_.opened(Clock::wallNs(),
               followed->link);  // throws, and ends the session, if it cannot write
  followed_.emplace(name, std::move(*followed));
}

std::optional<TapSession::Followed> TapSession::tryOpen(const std::string& name,
                                                        FollowFrom from) try {
  auto follower = LinkFollower::tryOpen(selection_.backplane, name, from);
  if (!follower) {
    ++goneLinks_;
    return std::nullopt;
  }
  auto link = describe(selection_.backplane, follower->header());
  return Followed{std::move(link), std::move(follower)};
} catch (const std::exception& error) {
  notFollowed_.insert(name);
  problems_.emplace_back(error.what());
  return std::nullopt;
}

bool TapSession::runOnce() {
  const auto names = names_.take();
  if (names) lookAtNew(*names);
  if (!names || lookAgain_.hasPassed()) lookAtNames(FollowFrom::first);
  bool some = false;
  for (auto& [name, followed] : followed_) {
    if (take(followed)) some = true;
    else reportMissed(followed);
  }
  return some;
}

bool TapSession::take(Followed& followed) {
  batch_.clear();
  const bool some = followed.follower->take(batch_);
  const auto atNs = Clock::wallNs();
  if (const auto left = selection_.count - seen_; batch_.size() > left)
    batch_.erase(batch_.begin() + static_cast<std::ptrdiff_t>(left), batch_.end());
  for (const auto& message : batch_) sink_.message(atNs, followed.link, message);
  seen_ += batch_.size();
  return some;
}

// A message that is just being sent counts as missed for a moment. So a number of missed messages
// is reported only if two successive calls find the same number.
void TapSession::reportMissed(Followed& followed) {
  const auto missed = followed.follower->missed();
  if (missed != std::exchange(followed.missedSeen, missed) || missed == followed.missedReported)
    return;
  followed.missedReported = missed;
  sink_.missed(Clock::wallNs(), followed.link, missed);
}

void TapSession::drain(Followed& followed) {
  // Reads at most as many messages as fit into the rings: more were sent after this call began, and
  // a client that keeps sending must not delay the end.
  const auto& header = followed.follower->header();
  std::size_t left = std::size_t{header.queueSlots} + header.replySlots + header.moreReplySlots;
  while (left != 0 && take(followed))
    left -= std::min(left, std::max<std::size_t>(batch_.size(), 1));
  reportMissed(followed);
  reportMissed(followed);
  missedBefore_ += followed.follower->missed();
}

void TapSession::close(Followed& followed) {
  drain(followed);
  sink_.closed(Clock::wallNs(), followed.link);
}

void TapSession::finish() {
  runOnce();  // finds the links that are new
  for (auto& [name, followed] : followed_) drain(followed);
  followed_.clear();
}

std::uint64_t TapSession::missed() const noexcept {
  std::uint64_t missed = missedBefore_;
  for (const auto& [name, followed] : followed_) missed += followed.follower->missed();
  return missed;
}

}  // namespace mpf::tools
