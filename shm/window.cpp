// SPDX-License-Identifier: MIT
#include "shm/window.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <fmt/format.h>
#include <optional>
#include <pwd.h>
#include <system_error>
#include <thread>

#include "base/expedited_barrier.h"
#include "base/step.h"
#include "shm/cache_line.h"
#include "shm/process.h"
#include "shm/segment_name.h"

namespace mpf {
namespace {

// "user root", the owner of a segment; "another user" when it is gone.
std::string ownerOf(const std::string& name) {
  const auto user = segments::userOf(name);
  if (!user) return "another user";
  std::array<char, 4096> texts{};
  passwd entry{};
  passwd* found = nullptr;
  ::getpwuid_r(*user, &entry, texts.data(), texts.size(), &found);
  return found != nullptr ? fmt::format("user {}", found->pw_name) : fmt::format("user {}", *user);
}

// Opens the window that has the name that we want; nullopt if no file has this name. For any other
// file throws an exception that says what to do.
std::optional<Segment> openConflicting(const std::string& name, layout::SegmentKind kind) try {
  return Segment::tryOpen(name, kind, Segment::Access::readOnly);
} catch (const std::system_error& error) {
  if (error.code().value() == EACCES)
    throw NameInUse(
        fmt::format("{}: belongs to {}, and only that user can tell whether its process is alive; "
                    "`mpf clean` as that user removes it if the process is dead",
                    segments::path(name), ownerOf(name)));
  throw SegmentError(fmt::format("{}: remove it if no program uses it", error.what()));
} catch (const SegmentError& error) {
  if (segments::probeOwner(name) == segments::Owner::alive)
    throw NameInUse(
        fmt::format("another program uses a file that is not a usable segment: {}", error.what()));
  throw SegmentError(fmt::format("{}: remove it if no program uses it", error.what()));
}

[[noreturn]] void throwNameInUse(const Segment& window) {
  const auto& header = window.header();
  throw NameInUse(
      fmt::format("server \"{}\" at location {} is already running: {}, pid {} ({}); stop it, or "
                  "use another name, location or backplane",
                  segments::text(header.name), header.location, segments::text(header.program),
                  header.ownerPid, segments::path(window.name())));
}

// Returns if the conflicting window of a name has disappeared or is about to be removed. Otherwise
// throws an exception that says which process has the name.
//   reaperIsLate  how long to wait for another process that removes a dead window
void checkConflict(const std::string& name, layout::SegmentKind kind, Deadline reaperIsLate) {
  const auto window = openConflicting(name, kind);
  if (!window) return;
  const auto& header = window->header();
  switch (segments::probeOwner(name, header.incarnation)) {
    case segments::Owner::absent:
      return;
    case segments::Owner::alive:
      throwNameInUse(*window);
    case segments::Owner::dead:
      if (segments::removeIfOwnerless(name)) return;
      if (!reaperIsLate.hasPassed() &&
          ::faccessat(AT_FDCWD, segments::path(name).c_str(), W_OK, AT_EACCESS) == 0)
        return;
      throw SegmentError(
          fmt::format("{}: left by a dead process of user {}; remove it as this user with "
                      "`mpf clean`, or end the process that is stuck while it removes it",
                      segments::path(name), header.ownerUid));
  }
}

// The mode of a FIFO. A process that may only read the hints must not read the FIFO: it would
// consume rings.
mode_t pipeMode(mode_t hints) {
  return 0600 | ((hints & 0020) != 0 ? 0060u : 0u) | ((hints & 0002) != 0 ? 0006u : 0u);
}

// The smallest rights that include both.
Rights joined(const Rights& now, Rights added) {
  constexpr auto kOwn = ~std::uint32_t{0};
  if (added.user == ::geteuid()) added.user = kOwn;
  if ((added.mode & 0022) == 0 && added.user == kOwn) return now;
  added.mode |= now.mode;
  if ((now.mode & 0022) == 0 && now.user == kOwn) return added;
  if (now.user == added.user && (now.group == added.group || (added.mode & 0060) == 0))
    return added;
  return {.mode = 0666, .group = now.group, .user = now.user};
}

}  // namespace

void checkNameIsFree(const std::string& name) {
  // userOf() needs no descriptor: if no descriptor is left, the error of OwnWindow says so.
  const bool exists = segments::userOf(name).has_value();
  if (!exists || segments::probeOwner(name) != segments::Owner::alive) return;
  const auto window = openConflicting(name, layout::SegmentKind::serverWindow);
  if (window && segments::probeOwner(name, window->header().incarnation) == segments::Owner::alive)
    throwNameInUse(*window);
}

OwnWindow::OwnWindow(const std::string& backplane, layout::SegmentKind kind,
                     const std::string& name, Rights rights,
                     const std::function<void(layout::SegmentHeader&)>& describe)
    : rights_(rights), admitted_(rights) {
  window_ = Segment::create(layout::kWindowBytes, kind, backplane,
                            {rights.mode & kReadableByAll.mode, rights.group});
  window_.lockForLife();
  MPF_STEP(window_locked);
  auto& header = window_.sharedHeader();
  header.linkMode = rights.mode;
  header.linkGroup = rights.group;
  header.takesBarriers = expedited_barrier::tryRegister() ? 1 : 0;
  describe(header);
  const auto incarnation = header.incarnation;
  control().state.store(layout::WindowState::open, std::memory_order_relaxed);
  control().sleeping.store(layout::SleepState::awake, std::memory_order_relaxed);

  hints_ =
      Segment::create(sizeof(layout::WindowHints), layout::SegmentKind::hints, backplane, rights);
  hints_.lockForLife();
  hints_.sharedHeader().ownerWindow = incarnation;
  // Built before, because nothing may fail between the creation of a file and the `try`.
  const auto hintsName = SegmentName::keyed(backplane, NameKind::hints, incarnation);
  fifoName_ = SegmentName::keyed(backplane, NameKind::fifo, incarnation);
  if (!hints_.tryPublish(hintsName))
    throw NameInUse(fmt::format("{}: duplicate incarnation number", segments::path(hintsName)));
  try {
    fifo_ = doorbell::createFifo(fifoName_, pipeMode(rights.mode), rights.group);
    MPF_STEP(window_complete);
    publish(name.empty() ? SegmentName::keyed(backplane, NameKind::clientWindow, incarnation)
                         : name);
  } catch (...) {
    segments::remove(fifoName_);
    segments::remove(hints_.name());
    throw;
  }
}

void OwnWindow::publish(const std::string& name) {
  // If the name is in use, its owner may be ending, or another process may be removing the window
  // of a dead owner. Both need microseconds of processor time. On a busy host, though, a process
  // that removed a window was seen to get no processor for more than 50 ms, and on a host with 60
  // busy processes on 2 processors for more than 2 s.
  const auto patience = Deadline::after(std::chrono::milliseconds(50));
  const auto reaperIsLate = Deadline::after(std::chrono::seconds(10));
  while (!window_.tryPublish(name)) {
    if (segments::removeIfOwnerless(name)) continue;
    if (patience.hasPassed()) checkConflict(name, header().kind, reaperIsLate);
    std::this_thread::sleep_for(std::chrono::microseconds(20));
  }
}

OwnWindow::~OwnWindow() {
  if (forkGuard_.isInherited()) return;
  // PAIR(window-closed): the owner has sent its messages and closed its links before.
  control().state.store(layout::WindowState::closed, std::memory_order_release);
  MPF_STEP(window_closed);
  segments::remove(fifoName_);
  segments::remove(hints_.name());
  // A window that has lost its name must not remove that of its successor.
  if (!isNameless()) segments::remove(window_.name());
}

void OwnWindow::admit(const Rights& peers) {
  const auto wanted = joined(admitted_, peers);
  if (wanted == admitted_) return;
  hints_.setRights(wanted);
  setRights(fifo_.get(),
            {.mode = pipeMode(wanted.mode), .group = wanted.group, .user = wanted.user});
  admitted_ = wanted;
}

void OwnWindow::ring() const noexcept {
  if (forkGuard_.isInherited()) return;
  doorbell::ring(hints().bell);
  static_cast<void>(doorbell::tryRingFifo(fifo_));
}

std::shared_ptr<PeerWindow> PeerWindow::tryOpen(const std::string& name, layout::SegmentKind kind) {
  auto window = Segment::tryOpen(name, kind, Segment::Access::readOnly);
  if (!window) return nullptr;
  if (window->bytes() < layout::kWindowBytes)
    throw SegmentError(fmt::format("{}: truncated", segments::path(name)));
  if (window->bytes() > layout::kWindowBytes)
    throw SegmentError(fmt::format("{}: has {} bytes, but a window has {}", segments::path(name),
                                   window->bytes(), layout::kWindowBytes));
  const auto parsed = SegmentName::tryParse(name);
  if (!parsed)
    throw SegmentError(fmt::format("{}: not the name of a window", segments::path(name)));
  // Any peer may have overwritten the header of the hints, so it is not checked. The header of the
  // window, which peers cannot write, is sufficient.
  auto hints = Segment::tryOpenShared(
      SegmentName::keyed(parsed->backplane, NameKind::hints, window->header().incarnation),
      sizeof(layout::WindowHints));
  if (!hints) return nullptr;
  hints->closeFile();
  MPF_STEP(peer_mapped);
  auto peer = std::make_shared<PeerWindow>();
  peer->window_ = std::move(*window);
  peer->hints_ = std::move(*hints);
  peer->fifoName_ =
      SegmentName::keyed(parsed->backplane, NameKind::fifo, peer->header().incarnation);
  return peer;
}

bool PeerWindow::hasOwner() const noexcept {
  return process_ ? isLocked() && !Process::hasEnded(process_) : window_.hasOwner();
}

void PeerWindow::notify(std::uint32_t index) noexcept {
  auto& hint = hints();
  index %= layout::kMaxLinks;
  const auto word = index / 64;
  // PAIR(ready-bit): an owner that sees the bit sees the message or the change of state.
  hint.readyBits[word].fetch_or(std::uint64_t{1} << (index % 64), std::memory_order_release);
  MPF_STEP(ready_bit_set);
  // PAIR(ready-word): an owner that sees the word's bit sees the ready bit.
  hint.readyWords[word / 64].fetch_or(std::uint64_t{1} << (word % 64), std::memory_order_release);
  wakeIfAsleep();
}

void PeerWindow::expectNotify(std::uint32_t index) const noexcept {
  const auto& hint = hints();
  const auto word = index % layout::kMaxLinks / 64;
  lines::request(&hint.readyBits[word]);
  lines::request(&hint.readyWords[word / 64]);
  __builtin_prefetch(&control().sleeping);
  lines::request(&hint.bell);
}

void PeerWindow::knock(std::uint64_t incarnation) noexcept {
  auto& hint = hints();
  // PAIR(knock): an owner that sees the incarnation finds the link under its name.
  const auto overwritten =
      hint.knocks[incarnation % layout::kKnocks].exchange(incarnation, std::memory_order_acq_rel);
  if (overwritten != 0 && overwritten != incarnation)
    hint.rescan.store(1, std::memory_order_relaxed);
  MPF_STEP(knock_placed);
  // PAIR(knocked): an owner that sees the new count finds the knock.
  hint.knocked.fetch_add(1, std::memory_order_release);
  MPF_STEP(knock_counted);
  wakeIfAsleep();
}

void PeerWindow::wakeIfAsleep() noexcept {
  MPF_STEP(peer_notified);
  // PAIR(sleep-fence): our message is before the fence, our load of the owner's state after it.
  doorbell::fence();
  // PAIR(sleep-number): loaded before the owner's state.
  const auto number = control().sleepNumber.load(std::memory_order_acquire);
  const auto sleeping = control().sleeping.load(std::memory_order_relaxed);
  if (sleeping == layout::SleepState::awake) return;
  // An owner that was woken but has not run yet still looks asleep. One ring for each sleep is
  // enough. Only a ring of this process counts, because it is complete; another process may have
  // been stopped in the middle of its ring. If the owner has announced another sleep, whose number
  // we do not see yet, its fence comes after ours, so it sees our message before it sleeps.
  if (number != 0 && rungFor_.load(std::memory_order_relaxed) == number) return;
  if (tryRing(sleeping)) rungFor_.store(number, std::memory_order_relaxed);
}

// Returns false if the owner was not rung: for example because no descriptor is free.
bool PeerWindow::tryRing(layout::SleepState sleeping) noexcept {
  if (sleeping == layout::SleepState::onFutex) {
    doorbell::ring(hints().bell);
    return true;
  }
  const std::lock_guard lock(fifoMutex_);
  if (!fifo_) fifo_ = doorbell::tryOpenFifo(fifoName_);
  return doorbell::tryRingFifo(fifo_);
}

}  // namespace mpf
