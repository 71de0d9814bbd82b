// SPDX-License-Identifier: MIT
#include "tools/torture/sabotage.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <chrono>
#include <thread>
#include <utility>

#include "base/system_call.h"
#include "shm/layout.h"
#include "shm/segment.h"
#include "shm/segment_name.h"
#include "tools/torture/talk.h"

namespace mpf::torture {
namespace {

// Visits the windows or the links of this process.
template <class Visit>
void forEachOwn(layout::SegmentKind kind, NameKind nameKind, const std::string& backplane,
                Visit&& visit) {
  for (const auto& name : segments::list(SegmentName::prefix(backplane))) {
    const auto parsed = SegmentName::tryParse(name);
    if (!parsed || parsed->kind != nameKind) continue;
    const auto segment = Segment::tryOpen(name, kind, Segment::Access::readWrite);
    if (segment && segment->header().ownerPid == ::getpid()) visit(*segment);
  }
}

template <class Visit>
void forEachOwnLink(const std::string& backplane, Visit&& visit) {
  forEachOwn(layout::SegmentKind::link, NameKind::link, backplane, visit);
}

// Leaves a link from a living client to a server that does not exist.
void leaveLink(const std::string& backplane) {
  std::uint64_t owner = 0;
  forEachOwnLink(backplane, [&](const Segment& link) { owner = link.header().ownerWindow; });
  auto link =
      Segment::create(layout::linkBytes(16, 16, 0), layout::SegmentKind::link, backplane, {});
  link.sharedHeader().ownerWindow = owner;
  static_cast<void>(link.tryPublish(
      SegmentName::link(backplane, segments::newIncarnation(), link.header().incarnation)));
}

}  // namespace

void Saboteur::sabotage(Talk& mortal, bool rests) {
  const bool begins = rests && !std::exchange(rested_, rests);
  rested_ = rests;
  if (sabotage_ == Sabotage::loseFate && !rests) mortal.loseNextFate();
  if (sabotage_ == Sabotage::leak && begins)
    leaked_.emplace_back(::open("/dev/null", O_RDONLY | O_CLOEXEC));
  if (sabotage_ == Sabotage::stale && begins) leaveLink(backplane_);
}

void leaveChildBehind(const World& world, const std::string& backplane) {
  // Without a pid in the header, the lock is the only evidence that the owner is alive.
  forEachOwn(layout::SegmentKind::serverWindow, NameKind::serverWindow, backplane,
             [](const Segment& window) { window.sharedHeader().ownerPid = 0; });
  // Calls clone() directly instead of fork(), so that no atfork handler closes the window's file:
  // the child then keeps the lock after the parent has died.
  if (checkCall(::syscall(SYS_clone, SIGCHLD, nullptr, nullptr, nullptr, nullptr), "clone") != 0)
    return;
  const auto referee = world.referee;
  while (world.isOver.load() == 0 && ::kill(referee, 0) == 0)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  ::_exit(0);
}

void publishHalfMessage(const std::string& backplane) {
  forEachOwnLink(backplane, [](const Segment& link) {
    const auto& control = link.at<layout::LinkControl>(layout::kLinkControlOffset);
    const auto next = control.requests.freed.load(std::memory_order_relaxed);
    auto* slots = &link.at<layout::Slot>(layout::kLinkRingsOffset);
    slots[next % link.header().queueSlots].sequence.store(next + 1, std::memory_order_relaxed);
  });
}

}  // namespace mpf::torture
