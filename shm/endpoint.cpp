// SPDX-License-Identifier: MIT
#include "shm/endpoint.h"

#include <sched.h>

#include <bit>

#include "base/step.h"
#include "shm/cpu_relax.h"
#include "shm/stale_segments.h"

namespace mpf {
namespace {

constexpr std::uint32_t kCoolAfter = 4096;  // polls without a message before polling of a link ends
// polls without a message before a busier link may replace a polled one
constexpr std::uint32_t kReplaceAfter = 64;
constexpr std::uint32_t kHintsEvery = 16;  // messages of polled links between looks at the hints
constexpr std::uint32_t kClockEvery = 64;  // spins between readings of the clock
// spins between calls of sched_yield(), for peers that share the processor
constexpr std::uint32_t kYieldEvery = 1u << 14;
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
      mode_(mode) {}

Endpoint::~Endpoint() {
  if (forkGuard().isInherited()) return;
  for (const auto& [name, peer] : peers_) backplane_.watcher().forget(peer.token);
}

std::optional<std::uint32_t> Endpoint::tryReserve() noexcept {
  if (!freeIndices_.empty()) {
    const auto index = freeIndices_.back();
    freeIndices_.pop_back();
    return index;
  }
  if (links_.size() >= layout::kMaxLinks) return std::nullopt;
  links_.push_back(nullptr);
  return static_cast<std::uint32_t>(links_.size() - 1);
}

void Endpoint::attach(std::uint32_t index, Link& link) {
  links_[index] = &link;
  control().linkCount.store(control().linkCount.load(std::memory_order_relaxed) + 1,
                            std::memory_order_relaxed);
  setReadyBit(index);
}

void Endpoint::detach(std::uint32_t index) noexcept {
  coolLink(index);
  if (links_[index] != nullptr) {
    control().linkCount.store(control().linkCount.load(std::memory_order_relaxed) - 1,
                              std::memory_order_relaxed);
  }
  links_[index] = nullptr;
  freeIndices_.push_back(index);
}

void Endpoint::hold(std::uint32_t index) noexcept {
  coolLink(index);
  links_[index] = nullptr;
}

void Endpoint::release(std::uint32_t index, Link& link) noexcept {
  links_[index] = &link;
  setReadyBit(index);
  window_.ring();
}

std::shared_ptr<PeerWindow> Endpoint::peer(const std::string& name, layout::SegmentKind kind) {
  dropPeers();
  const auto [first, last] = peers_.equal_range(name);
  for (auto peer = first; peer != last; ++peer) {
    auto window = peer->second.window.lock();
    // Links may still use a window that is closed or lost. It stays watched, because its owner may
    // die before it has closed these links.
    if (window && !window->isDead() && !window->isClosed() && !window->isLost()) return window;
  }
  auto window = PeerWindow::tryOpen(name, kind);
  if (!window || window->isClosed() || !window->hasOwner()) return nullptr;
  const auto clean = [this, backplane = backplane_.name(), name,
                      incarnation = window->header().incarnation] {
    stale_segments::removeDeadWindow(backplane, name, incarnation);
    peerDied_.store(true, std::memory_order_relaxed);
    interrupt();
  };
  peers_.emplace(name, Peer{window, backplane_.watcher().watchPeer(window, clean)});
  return window;
}

void Endpoint::dropPeers() noexcept {
  for (auto peer = peers_.begin(); peer != peers_.end();) {
    if (peer->second.window.use_count() > 1) {  // the watcher holds one reference
      ++peer;
      continue;
    }
    backplane_.watcher().forget(peer->second.token);
    peer = peers_.erase(peer);
  }
}

std::optional<std::uint32_t> Endpoint::next() noexcept {
  if (armed_) disarm();
  // The polled links have had their turns. The next turn goes to another link: while all polled
  // links are busy, the other links would never be reached below.
  if (sinceHints_ >= (hotCount_ == kHotLinks ? kHotLinks : kHintsEvery)) {
    if (const auto index = nextCold()) return index;
  }
  for (std::size_t looked = 0; looked < hotCount_; ++looked) {
    cursor_ = cursor_ + 1 < hotCount_ ? cursor_ + 1 : 0;
    auto& hot = hot_[cursor_];
    if (hot.link->incoming().hasMessage()) {
      hot.misses = 0;
      ++sinceHints_;
      return hot.index;
    }
    if (++hot.misses >= kCoolAfter) {
      const auto index = hot.index;
      cool(cursor_);
      if (links_[index]->incoming().hasMessage()) return index;
      break;
    }
  }
  return nextReady();
}

// Takes one message of each ready link. The round ends when the index wraps around.
std::optional<std::uint32_t> Endpoint::nextCold() noexcept {
  const auto from = readyCursor_;
  const auto index = nextReady();
  if (!index || *index < from) sinceHints_ = 0;
  return index;
}

std::optional<std::uint32_t> Endpoint::nextReady() noexcept {
  if (revisit_) {
    if (isRevisitDue()) setReadyBit(*revisit_);
    revisit_.reset();
  }
  if (++sinceScan_ >= kScanAllEvery) {
    sinceScan_ = 0;
    tryScanAllLinks();
  }
  if (!hasReadyWords()) return std::nullopt;
  constexpr auto kWords = layout::kMaxLinks / 64;
  // Start after the last index, so that links with low indices do not starve those with high ones.
  for (std::size_t looked = 0; looked < kWords; ++looked) {
    const auto word = (readyCursor_ / 64 + looked) % kWords;
    if (const auto index = takeReadyBit(word)) return index;
  }
  return std::nullopt;
}

std::optional<std::uint32_t> Endpoint::takeReadyBit(std::size_t word) noexcept {
  auto& hints = window_.hints();
  const auto wordBit = std::uint64_t{1} << (word % 64);
  if ((hints.readyWords[word / 64].load(std::memory_order_relaxed) & wordBit) == 0)
    return std::nullopt;
  // PAIR(ready-word): cleared before the ready bits are read. A peer that sets a ready bit later
  // sets this bit again.
  hints.readyWords[word / 64].fetch_and(~wordBit, std::memory_order_acq_rel);
  MPF_STEP(ready_word_taken);
  const auto bits = hints.readyBits[word].load(std::memory_order_relaxed);
  if (bits == 0) return std::nullopt;
  const auto start = readyCursor_ / 64 == word ? readyCursor_ % 64 : 0;
  const auto rotated = std::rotr(bits, static_cast<int>(start));
  const auto bit = (static_cast<std::uint32_t>(std::countr_zero(rotated)) + start) % 64;
  // PAIR(ready-bit): cleared before the caller looks at the link.
  const auto left =
      hints.readyBits[word].fetch_and(~(std::uint64_t{1} << bit), std::memory_order_acq_rel) &
      ~(std::uint64_t{1} << bit);
  MPF_STEP(ready_bit_taken);
  // PAIR(ready-word): set again, because other bits of this word are still set.
  if (left != 0) hints.readyWords[word / 64].fetch_or(wordBit, std::memory_order_release);
  const auto index = static_cast<std::uint32_t>(word * 64 + bit);
  readyCursor_ = (index + 1) % layout::kMaxLinks;
  if (index >= links_.size() || links_[index] == nullptr) return std::nullopt;
  heat(index);
  return index;
}

void Endpoint::heat(std::uint32_t index) noexcept {
  for (std::size_t position = 0; position < hotCount_; ++position) {
    if (hot_[position].index == index) return;
  }
  for (std::size_t position = 0; position < hotCount_ && hotCount_ == kHotLinks; ++position) {
    if (hot_[position].misses >= kReplaceAfter) cool(position);
  }
  if (hotCount_ == kHotLinks) {
    revisit_ = index;
    return;
  }
  hot_[hotCount_++] = {index, 0, links_[index]};
  links_[index]->setWatched(true);
}

void Endpoint::cool(std::size_t position) noexcept {
  const auto hot = hot_[position];
  hot_[position] = hot_[--hotCount_];
  hot.link->setWatched(false);
  if (hot.link->hasEvents()) setReadyBit(hot.index);
}

void Endpoint::coolLink(std::uint32_t index) noexcept {
  for (std::size_t position = 0; position < hotCount_; ++position) {
    if (hot_[position].index == index) return cool(position);
  }
}

void Endpoint::coolAll() noexcept {
  while (hotCount_ != 0) cool(hotCount_ - 1);
}

void Endpoint::setReadyBit(std::uint32_t index) noexcept {
  auto& hints = window_.hints();
  const auto word = index / 64;
  hints.readyBits[word].fetch_or(std::uint64_t{1} << (index % 64), std::memory_order_relaxed);
  // PAIR(ready-word): set after the ready bit.
  hints.readyWords[word / 64].fetch_or(std::uint64_t{1} << (word % 64), std::memory_order_release);
}

std::optional<std::uint64_t> Endpoint::takeKnock() noexcept {
  auto& hints = window_.hints();
  // PAIR(knocked): read before the knocks that it counts.
  const auto knocked = hints.knocked.load(std::memory_order_acquire);
  if (knocked != knockedSeen_) {
    knockedSeen_ = knocked;
    knockCursor_ = 0;
  }
  for (; knockCursor_ < layout::kKnocks; ++knockCursor_) {
    auto& knock = hints.knocks[knockCursor_];
    if (knock.load(std::memory_order_relaxed) == 0) continue;
    // PAIR(knock): the link already has its name.
    if (const auto incarnation = knock.exchange(0, std::memory_order_acq_rel); incarnation != 0) {
      MPF_STEP(knock_taken);
      return incarnation;
    }
  }
  return std::nullopt;
}

bool Endpoint::takeRescan() noexcept {
  auto& rescan = window_.hints().rescan;
  return rescan.load(std::memory_order_relaxed) != 0 &&
         rescan.exchange(0, std::memory_order_relaxed) != 0;
}

bool Endpoint::takeLocalNews() noexcept {
  if (localNews_.load(std::memory_order_relaxed) == 0) return false;
  // PAIR(local-news): sees everything that happened before interrupt().
  return localNews_.exchange(0, std::memory_order_acquire) != 0;
}

void Endpoint::interrupt() noexcept {
  // PAIR(local-news): stored after the event.
  localNews_.store(1, std::memory_order_release);
  window_.ring();
}

bool Endpoint::hasReadyWords() const noexcept {
  const auto& words = window_.hints().readyWords;
  return std::any_of(words.begin(), words.end(),
                     [](const auto& word) { return word.load(std::memory_order_relaxed) != 0; });
}

bool Endpoint::hasHints() const noexcept { return hasReadyWords() || hasSideNews(); }

bool Endpoint::hasNews() const noexcept {
  for (std::size_t position = 0; position < hotCount_; ++position) {
    if (hot_[position].link->incoming().hasMessage()) return true;
  }
  return isRevisitDue() || hasHints();
}

bool Endpoint::isRevisitDue() const noexcept {
  return revisit_ && links_[*revisit_] != nullptr && links_[*revisit_]->hasEvents();
}

bool Endpoint::wait(Deadline deadline) noexcept {
  slept_ = false;
  if (spin(deadline)) return true;
  while (!deadline.hasPassed()) {
    sleep(deadline);
    if (hasNews()) return true;
  }
  return false;
}

bool Endpoint::spin(Deadline deadline) noexcept {
  if (hasNews()) return true;
  if (mode_ == WaitMode::block) return false;
  const auto budgetNs = mode_ == WaitMode::spin ? INT64_MAX : (2 * wakeNs_) >> spinShift_;
  std::int64_t startNs = 0;
  for (std::uint32_t spins = 1;; ++spins) {
    cpuRelax();
    if (hasNews()) return true;
    if (spins % kClockEvery != 0) continue;
    const auto nowNs = Clock::nowNs();
    if (startNs == 0) startNs = nowNs;
    if (nowNs >= deadline.ns() || nowNs - startNs >= budgetNs) return false;
    if (spins % kYieldEvery != 0) continue;
    tryScanAllLinks();
    ::sched_yield();
  }
}

void Endpoint::announce(layout::SleepState how) noexcept {
  coolAll();
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
  if (!hasNews()) {
    const auto sleptFrom = mode_ == WaitMode::adaptive ? Clock::nowNs() : 0;
    MPF_STEP(falling_asleep);
    doorbell::sleep(bell, seen, until);
    MPF_STEP(woken);
    slept_ = true;
    control().wakes.store(control().wakes.load(std::memory_order_relaxed) + 1,
                          std::memory_order_relaxed);
    if (mode_ == WaitMode::adaptive) {
      spinShift_ = Clock::nowNs() - sleptFrom < 4 * wakeNs_ ? 0 : std::min(spinShift_ + 1, 5u);
    }
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
    if (links_[index] != nullptr && links_[index]->hasEvents()) setReadyBit(index);
  }
  return true;
}

bool Endpoint::arm() noexcept {
  doorbell::drainFifo(window_.fifo());
  announce(layout::SleepState::onDescriptor);
  tryScanAllLinks();
  armed_ = true;
  if (!hasNews()) return true;
  disarm();
  return false;
}

void Endpoint::disarm() noexcept {
  armed_ = false;
  control().sleeping.store(layout::SleepState::awake, std::memory_order_relaxed);
}

}  // namespace mpf
