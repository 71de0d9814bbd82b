// SPDX-License-Identifier: MIT
#include "shm/endpoint.h"

#include <sched.h>

#include <algorithm>
#include <utility>

#include "base/step.h"
#include "shm/cpu_relax.h"

namespace mpf {
namespace {

constexpr std::uint32_t kHintsEvery = 16;  // turns of polled links between looks at hints
constexpr int kLooksAtPolled = 4;  // in each spin
constexpr std::uint32_t kClockEvery = 8;  // spins between readings of the clock
// spins between scans of all links; WaitMode::spin then also gives up the processor once
constexpr std::uint32_t kScanEvery = 1u << 12;
constexpr std::uint32_t kScanAllEvery = 1024;  // looks at the hints between scans of all links
// with at most this number of links, a scan of all links costs next to nothing
constexpr std::size_t kFewLinks = 64;
constexpr std::int64_t kScanAllNs = 100'000'000;  // shortest time between scans of more links

}  // namespace

Endpoint::Endpoint(Backplane backplane, layout::SegmentKind kind, const std::string& name,
                   Rights rights, WaitMode mode,
                   const std::function<void(layout::SegmentHeader&)>& describe)
    : backplane_(std::move(backplane)),
      window_(backplane_.name(), kind, name, rights,
              [&](layout::SegmentHeader& header) {
                header.waitMode = static_cast<std::uint32_t>(mode);
                describe(header);
              }),
      mode_(mode),
      readyBits_(window_.hints()),
      hot_(readyBits_, mode != WaitMode::block),
      knocks_(window_.hints()),
      peers_(backplane_, [this] {
        peerDied_.store(true, std::memory_order_relaxed);
        interrupt();
      }) {}

std::optional<std::uint32_t> Endpoint::tryReserve() {
  if (!freeIndices_.empty()) {
    const auto index = freeIndices_.back();
    freeIndices_.pop_back();
    return index;
  }
  if (links_.size() >= layout::kMaxLinks) return std::nullopt;
  links_.push_back(nullptr);
  freeIndices_.reserve(links_.capacity());  // detach() must not fail
  return static_cast<std::uint32_t>(links_.size() - 1);
}

void Endpoint::countLinks(std::int32_t more) noexcept {
  auto& links = control().linkCount;
  links.store(links.load(std::memory_order_relaxed) + static_cast<std::uint32_t>(more),
              std::memory_order_relaxed);
}

void Endpoint::attach(std::uint32_t index, Link& link, LinkUser& user) {
  link.setUser(user);
  links_[index] = &link;
  countLinks(+1);
  readyBits_.set(index);
}

void Endpoint::detach(std::uint32_t index) noexcept {
  hot_.remove(index);
  if (links_[index] != nullptr) countLinks(-1);
  links_[index] = nullptr;
  freeIndices_.push_back(index);
}

void Endpoint::hold(std::uint32_t index) noexcept {
  hot_.remove(index);
  links_[index] = nullptr;
}

void Endpoint::release(std::uint32_t index, Link& link) noexcept {
  links_[index] = &link;
  readyBits_.set(index);
  window_.ring();
}

Link* Endpoint::nextOther() noexcept {
  peers_.settle();
  if (polledLeft_ != 0) return nextReady();
  if (armed_) disarm();
  if (auto* const link = nextCold()) return link;
  return next();
}

// Returns the ready links, one by one. The round ends when the index wraps around; then the polled
// links have kHintsEvery turns, or, if as many links are polled as may be, one each, so that a busy
// link that is not polled waits no longer than that.
Link* Endpoint::nextCold() noexcept {
  const auto from = readyBits_.position();
  auto* const link = nextReady();
  if (link == nullptr || readyBits_.position() <= from)
    polledLeft_ = hot_.size() == HotLinks::kCapacity ? HotLinks::kCapacity : kHintsEvery;
  return link;
}

Link* Endpoint::nextReady() noexcept {
  if (revisit_) {
    if (isRevisitDue()) readyBits_.set(*revisit_);
    else if (isAttached(*revisit_)) links_[*revisit_]->incoming().onEmpty();
    revisit_.reset();
  }
  if (++sinceScan_ >= kScanAllEvery) {
    sinceScan_ = 0;
    tryScanAllLinks();
  }
  if (!readyBits_.hasAny()) return nullptr;
  const auto index = readyBits_.tryTake([this](std::uint32_t of) { return isAttached(of); });
  if (!index) return nullptr;
  if (!hot_.tryAdd(*index, *links_[*index])) revisit_ = index;
  links_[*index]->expectSend();
  return links_[*index];
}

void Endpoint::interrupt() noexcept {
  // PAIR(local-event): stored after the event.
  localEvent_.store(1, std::memory_order_release);
  window_.ring();
}

bool Endpoint::hasEvents() const noexcept {
  return hot_.hasMessage() || isRevisitDue() || readyBits_.hasAny() || hasControlEvents();
}

bool Endpoint::isRevisitDue() const noexcept {
  return revisit_ && links_[*revisit_] != nullptr && links_[*revisit_]->hasEvents();
}

bool Endpoint::wait(Deadline deadline) noexcept {
  slept_ = false;
  if (spin(deadline)) return true;
  while (!deadline.hasPassed()) {
    sleep(deadline);
    if (hasEvents()) return true;
  }
  return false;
}

bool Endpoint::spin(Deadline deadline) noexcept {
  if (hasEvents()) return true;
  if (mode_ == WaitMode::block) return false;
  const bool isAdaptive = mode_ == WaitMode::adaptive;
  const auto budgetNs = isAdaptive ? spinBudget_.ns() : INT64_MAX;
  const auto plan = isAdaptive ? processor_.plan() : SharedProcessor::Plan::keep;
  // A sleep until a deadline this near would end after it.
  if (plan == SharedProcessor::Plan::sleep && deadline.left().count() > budgetNs) return false;
  std::int64_t startNs = 0;
  for (std::uint32_t spins = 1;; ++spins) {
    // Messages of polled links are the events that need a fast reaction.
    for (int looks = 0; looks < kLooksAtPolled; ++looks) {
      cpuRelax();
      if (hot_.hasMessage()) return foundByPolling();
    }
    if (hasEvents()) return foundByPolling();
    if (spins % kClockEvery != 0) continue;
    const auto nowNs = Clock::nowNs();
    if (startNs == 0) startNs = nowNs;
    if (nowNs >= deadline.ns() || nowNs - startNs >= budgetNs) return false;
    if (plan != SharedProcessor::Plan::keep) {
      ::sched_yield();
      const auto yieldNs = Clock::nowNs() - nowNs;
      const bool hasEvent = hasEvents();
      processor_.noteYield(yieldNs, hasEvent);
      if (hasEvent) return true;
    }
    if (spins % kScanEvery != 0) continue;
    tryScanAllLinks();
    if (!isAdaptive) ::sched_yield();
  }
}

bool Endpoint::foundByPolling() noexcept {
  processor_.notePolled();
  return true;
}

void Endpoint::announce(layout::SleepState how) noexcept {
  hot_.removeAll();
  control().sleeping.store(how, std::memory_order_relaxed);
  // PAIR(sleep-number): a peer that sees this number also sees how this or a later sleep wakes up.
  control().sleepNumber.store(++sleepNumber_, std::memory_order_release);
  MPF_STEP(sleep_announced);
  // PAIR(sleep-fence): our announcement is before the fence, our last look for messages after it.
  // PAIR(bell): sleep() has read the bell before this fence.
  doorbell::fence();
}

void Endpoint::sleep(Deadline deadline) noexcept {
  auto& bell = window_.hints().bell;
  // PAIR(bell): the fence in announce() is the acquire side of this load.
  const auto seen = bell.load(std::memory_order_relaxed);
  announce(layout::SleepState::onFutex);
  const auto until =
      tryScanAllLinks() ? deadline : std::min(deadline, Deadline::atNs(scannedAllNs_ + kScanAllNs));
  if (!hasEvents()) {
    const auto sleptFrom = mode_ == WaitMode::adaptive ? Clock::nowNs() : 0;
    MPF_STEP(falling_asleep);
    doorbell::sleep(bell, seen, until);
    MPF_STEP(woken);
    readyBits_.expectTake();
    slept_ = true;
    control().wakes.store(control().wakes.load(std::memory_order_relaxed) + 1,
                          std::memory_order_relaxed);
    if (mode_ == WaitMode::adaptive) spinBudget_.noteSleep(Clock::nowNs() - sleptFrom);
  }
  control().sleeping.store(layout::SleepState::awake, std::memory_order_relaxed);
}

// Looks at every link, because a faulty peer may have cleared the ready bit of another peer. Called
// before each sleep. With many links, it scans at most once in kScanAllNs; otherwise it returns
// false, and the caller must scan later.
bool Endpoint::tryScanAllLinks() noexcept {
  if (links_.size() > kFewLinks) {
    const auto nowNs = Clock::nowNs();
    if (nowNs - scannedAllNs_ < kScanAllNs) return false;
    scannedAllNs_ = nowNs;
  }
  for (std::uint32_t index = 0; index < links_.size(); ++index) {
    if (links_[index] != nullptr && links_[index]->hasEvents()) readyBits_.set(index);
  }
  return true;
}

bool Endpoint::arm() noexcept {
  if (isPolled_) return true;
  doorbell::drainFifo(window_.fifo());
  announce(layout::SleepState::onDescriptor);
  tryScanAllLinks();  // if it is too early, the next arm() scans: the descriptor has no timer
  armed_ = true;
  polledLeft_ = 0;
  if (!hasEvents()) return true;
  disarm();
  return false;
}

void Endpoint::disarm() noexcept {
  armed_ = false;
  control().sleeping.store(layout::SleepState::awake, std::memory_order_relaxed);
}

}  // namespace mpf
