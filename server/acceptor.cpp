// SPDX-License-Identifier: MIT
#include "server/acceptor.h"

#include <cstddef>
#include <fmt/format.h>
#include <utility>

#include "shm/histogram.h"
#include "shm/segment_name.h"
#include "shm/shortage.h"
#include "shm/stale_segments.h"

namespace mpf {
namespace {

constexpr std::size_t kMaxLinksPerRescan = 1024;
constexpr std::int64_t kRestAfterRescan = 9;  // times the duration of the rescan

}  // namespace

void Acceptor::acceptAll() {
  // Limited, because a faulty client may knock without end.
  for (std::uint32_t knocks = 0; knocks < layout::kKnocks; ++knocks) {
    const auto incarnation = endpoint_.knocks().tryTake();
    if (!incarnation) break;
    accept(*incarnation);
  }
  isRescanDue_ = endpoint_.knocks().takeRescan() || isRescanDue_;
  if (isRescanDue_) rescan();
}

// Accepts clients whose knock was lost. A client that a rescan does not find knocks again.
void Acceptor::rescan() {
  const auto fromNs = Clock::nowNs();
  if (fromNs < rescanFromNs_) return;
  isRescanDue_ = false;
  try {
    acceptFound();
  } catch (const std::exception& error) {
    isRescanDue_ = true;  // again after the next knock
    noteFailure(error);
  }
  const auto nowNs = Clock::nowNs();
  rescanFromNs_ = nowNs + kRestAfterRescan * (nowNs - fromNs);
}

// Accepts the clients of links whose names exist.
void Acceptor::acceptFound() {
  const auto prefix = SegmentName::linkPrefix(endpoint_.backplane().name(),
                                              endpoint_.window().header().incarnation);
  std::size_t accepted = 0;
  for (const auto& name : segments::list(prefix)) {
    const auto parsed = SegmentName::tryParse(name);
    if (!parsed || connections_.contains(parsed->incarnation)) continue;
    if (++accepted > kMaxLinksPerRescan) break;
    accept(parsed->incarnation);
  }
}

void Acceptor::accept(std::uint64_t incarnation) {
  if (connections_.contains(incarnation)) return;
  try {
    tryAccept(incarnation);
  } catch (const std::exception& error) {
    noteFailure(error);
  }
}

// A client is not accepted and knocks again; the server continues.
void Acceptor::noteFailure(const std::exception& error) {
  const auto shortage = shortageOf(error);
  if (shortage == layout::Shortage::none) return count(endpoint_.control().protocolErrors);
  noteShortage(shortage, error.what());
}

void Acceptor::tryAccept(std::uint64_t incarnation) {
  const auto& backplane = endpoint_.backplane().name();
  const auto name =
      SegmentName::link(backplane, endpoint_.window().header().incarnation, incarnation);
  auto link = Link::tryOpen(backplane, name, endpoint_.window());
  if (!link) return;
  const auto window =
      SegmentName::keyed(backplane, NameKind::clientWindow, link->header().clientWindow);
  auto client = endpoint_.peers().tryOpen(window, layout::SegmentKind::clientWindow);
  if (client && link->peerState() == layout::LinkState::open) {
    link->attachPeer(std::move(client), link->header().clientIndex);
    return open(std::move(link));
  }
  // A client creates its window before its links and removes it after them: without a window, this
  // client died after it had created the link.
  if (!client && segments::probeOwner(window) == segments::Owner::absent)
    Link::removeFiles(backplane, name, incarnation);
}

void Acceptor::open(std::unique_ptr<Link> link) {
  const auto index = endpoint_.tryReserve();
  if (!index) {
    link->setState(layout::LinkState::refused);
    link->notifyPeer();
    return;
  }
  auto& connection = connections_.add(*index, std::move(link));
  noteShortage(layout::Shortage::none, {});  // before the client learns that it is accepted
  connections_.open(connection);
}

// Each shortage counts as one alarm, for any number of clients that the server cannot accept.
void Acceptor::noteShortage(layout::Shortage shortage, const std::string& why) {
  auto& control = endpoint_.control();
  const auto was = control.shortage.load(std::memory_order_relaxed);
  if (was == shortage) return;
  control.shortage.store(shortage, std::memory_order_relaxed);
  const bool isOver = shortage == layout::Shortage::none;
  if (!isOver && was == layout::Shortage::none)
    control.alarms.fetch_add(1, std::memory_order_relaxed);
  if (onShortage_)
    onShortage_(isOver ? std::string() : fmt::format("{}; {}", why, textOf(shortage).remedy));
}

}  // namespace mpf
