// SPDX-License-Identifier: MIT
#include "tools/torture/referee.h"

#include <sys/wait.h>

#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <mpf/backplane.h>
#include <mpf/clock.h>

namespace mpf::torture {
namespace {

constexpr auto kLook = std::chrono::microseconds(500);  // between looks at what the actors report
constexpr std::uint64_t kEnough = 12;  // replies that show that somebody goes on
constexpr std::uint64_t kLife = 40;  // of a server: replies to the survivor
constexpr std::size_t kLinksAtRest = 2;  // the survivor's, to both servers

// What a process may hold more than in its first rounds: a descriptor that is about to be closed, a
// segment for a busier moment.
constexpr std::size_t kMoreDescriptors = 4;
constexpr std::size_t kMoreMappings = 16;
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr std::size_t kMoreHeapKiB = SIZE_MAX / 2;  // a sanitizer keeps what was freed
#else
constexpr std::size_t kMoreHeapKiB = 16 * 1024UL;
#endif
constexpr std::uint64_t kWarmUp = 20;  // rounds

std::string inWords(int status) {
  if (WIFSIGNALED(status)) return fmt::format("was ended by signal {}", WTERMSIG(status));
  return fmt::format("ended with status {}", WEXITSTATUS(status));
}

bool isOrderly(int status) { return WIFEXITED(status) && WEXITSTATUS(status) == 0; }

}  // namespace

const char* toString(Role role) noexcept { return role == Role::client ? "client" : "server"; }
const char* toString(Mode mode) noexcept { return mode == Mode::kill ? "kill" : "stop"; }

Referee::Referee(const Marks& marks, const Options& options)
    : marks_(marks),
      options_(options),
      backplane_(Backplane::isolated().name()),
      random_(options.seed) {
  steady_ = processes_.start([cast = cast()] { return playSteady(cast); });
  survivor_ = processes_.start([cast = cast()] { return playSurvivor(cast); });
  startMortal();
  waitFor("the survivors talk with each other",
          [&] { return repliesOf(0) >= kEnough && repliesOf(1) >= kEnough; });
}

Referee::~Referee() {
  (*world_).isOver.store(1);
  processes_.killAll();  // and none of them is left to leave something behind
  // A child that somebody left behind, which is not ours to wait for, ends soon after.
  const auto backplane = Backplane::named(backplane_);
  const auto patience = Deadline::after(std::chrono::seconds(5));
  do static_cast<void>(backplane.removeDead());
  while (!backplane.segmentNames().empty() && !patience.hasPassed());
}

Cast Referee::cast() {
  return {*world_, backplane_, static_cast<std::uint32_t>(random_()), options_.sabotage};
}

void Referee::waitFor(const std::string& what, const Condition& condition) {
  Nanoseconds waited{0};
  while (!condition()) {
    const auto sinceNs = Clock::nowNs();
    processes_.handleEvents(kLook);
    checkAlive();
    // Where so many wait for a processor that we do, too, the others are not what is slow.
    waited += std::min<Nanoseconds>(Nanoseconds(Clock::nowNs() - sinceNs), kLook);
    if (waited >= options_.patience)
      throw Broken(
          fmt::format("this did not come true in {} s: {}", options_.patience.count(), what));
  }
}

void Referee::checkAlive() const {
  if (const auto complaint = (*world_).complaint(); !complaint.empty()) throw Broken(complaint);
  if (processes_.hasEnded(survivor_)) throw Broken("the surviving client has ended");
  if (processes_.hasEnded(steady_)) throw Broken("the surviving server has ended");
}

// A process that leaves all that a process can leave.
void Referee::layOutCorpse() {
  const auto corpse = processes_.start([cast = cast()] { return playCorpse(cast); });
  waitFor("a process talks with itself and dies", [&] { return processes_.hasEnded(corpse); });
  processes_.takeStatus(corpse);
}

void Referee::startMortal() {
  (*world_).mortal.clear();
  mortalReplies_ = repliesOf(1);
  mortal_ = processes_.start([cast = cast()] { return playMortal(cast); });
}

void Referee::endMortal() {
  const auto& disconnects = (*world_).survivor.talked[1].disconnects;
  const auto before = disconnects.load();
  (*world_).mortal.leave.store(1);
  waitFor("the server ends in order",
          [&] { return processes_.hasEnded(mortal_) && disconnects.load() != before; });
  const auto status = processes_.takeStatus(std::exchange(mortal_, 0));
  if (!isOrderly(status))
    throw Broken(fmt::format("the server that was to end in order {}", inWords(status)));
}

// Starts the one to be tormented and its companion, and lets them go.
void Referee::live(Role role, const std::function<void(Tracee&)>& prepare) {
  boardOf(role).clear();
  pid_t pid = 0;
  if (role == Role::server) {
    endMortal();
    mortalReplies_ = repliesOf(1);
    (*world_).mortal.clear();
    pid = mortal_ = processes_.startHeld([cast = cast()] { return playMortal(cast); });
    companion_ = processes_.start([cast = cast()] { return playGuest(cast); });
  } else {
    companion_ = processes_.start([cast = cast()] { return playFleeting(cast); });
    pid = processes_.startHeld([cast = cast()] { return playVisitor(cast); });
  }
  tracee_ = std::make_unique<Tracee>(pid, marks_);
  processes_.setTracee(tracee_.get());
  prepare(*tracee_);
  processes_.letGo();
}

bool Referee::isLifeDone(Role role) const {
  return role == Role::server && repliesOf(1) - mortalReplies_ >= kLife &&
         processes_.hasEnded(companion_);
}

std::map<std::string, std::uint64_t> Referee::reconnoitre(Role role,
                                                          const std::set<std::string>& marks) {
  layOutCorpse();
  live(role, [&](Tracee& tracee) { tracee.watch(marks); });
  torment({role, Mode::stop, {}});
  settle();
  return tracee_->hits();
}

Outcome Referee::play(const Plan& plan) {
  ++rounds_;
  layOutCorpse();
  live(plan.role, [&](Tracee& tracee) { tracee.aim(plan.place); });
  torment(plan);
  settle();
  return {wasThere_, tracee_->cameToNextMark()};
}

void Referee::torment(const Plan& plan) {
  auto& victim = *tracee_;
  wasThere_ = false;
  waitFor(fmt::format("the {} lives its life", toString(plan.role)),
          [&] { return victim.isThere() || victim.isGone() || isLifeDone(plan.role); });
  if (!victim.isThere()) {
    boardOf(plan.role).leave.store(1);
    waitFor(fmt::format("the {} ends in order", toString(plan.role)),
            [&] { return victim.isThere() || victim.isGone(); });
  }
  wasThere_ = victim.isThere();
  if (wasThere_ && plan.mode == Mode::kill) {
    victim.kill();
    waitFor("a killed process is gone", [&] { return victim.isGone(); });
  } else {
    if (wasThere_) hold(plan.role);
    waitFor(fmt::format("the {} lives on", toString(plan.role)),
            [&] { return victim.isGone() || isLifeDone(plan.role); });
    boardOf(plan.role).leave.store(1);
    waitFor(fmt::format("the {} ends in order", toString(plan.role)),
            [&] { return victim.isGone(); });
    checkOrderlyEnd(plan.role);
  }
  processes_.setTracee(nullptr);
  processes_.takeStatus(victim.pid());
  processes_.kill(std::exchange(companion_, 0));
  if (plan.role == Role::server) startMortal();
}

void Referee::checkOrderlyEnd(Role role) const {
  if (isOrderly(tracee_->status())) return;
  throw Broken(fmt::format("the {} {}, and nobody had killed it", toString(role),
                           inWords(tracee_->status())));
}

// The stopped one is slow, not dead.
void Referee::hold(Role role) {
  auto& survivor = (*world_).survivor;
  // Who was told to leave may do so with another thread than the one that is held.
  const auto& board = boardOf(role);
  const bool leaving = board.leave.load() != 0 || board.isLeaving.load() != 0;
  const auto disconnects = survivor.talked[1].disconnects.load();
  const auto died = role == Role::client ? clientsDied(backplane_, "steady") : 0;
  const auto replies = repliesOf(0);
  waitFor("the survivors go on beside a stopped process",
          [&] { return repliesOf(0) - replies >= kEnough; });
  if (!leaving && survivor.talked[1].disconnects.load() != disconnects)
    throw Broken("a server that was only stopped was taken for dead");
  if (role == Role::client && clientsDied(backplane_, "steady") != died)
    throw Broken("a client that was only stopped was taken for dead");
  tracee_->release();
}

// Everybody rests, and all must be as it was.
void Referee::settle() {
  auto& survivor = (*world_).survivor;
  const auto steadyReplies = repliesOf(0);
  waitFor("the survivors go on", [&] { return repliesOf(0) - steadyReplies >= kEnough; });
  waitFor("the successor has its name, and its client", [&] {
    if (processes_.hasEnded(mortal_))
      throw Broken("the successor could not take the place of the one before");
    return repliesOf(1) - mortalReplies_ >= kEnough;
  });
  survivor.rest.store(1);
  waitFor("each request has an end", [&] { return survivor.isAtRest.load() != 0; });
  std::vector<std::string> stale;
  try {
    waitFor("nothing stale is left", [&] {
      static_cast<void>(Backplane::named(backplane_).removeDead());
      return (stale = staleSegments(backplane_, kLinksAtRest)).empty();
    });
  } catch (const Broken& broken) {
    throw Broken(fmt::format("{}; there are {}", broken.what(), fmt::join(stale, ", ")));
  }
  checkNoNonsense(backplane_);
  checkHoldings();
  survivor.rest.store(0);
  waitFor("the survivors go on after a rest", [&] { return survivor.isAtRest.load() == 0; });
}

void Referee::checkHoldings() {
  for (const auto pid : {survivor_, steady_}) {
    const auto& first = heldAtStart_.try_emplace(pid, Holdings::of(pid)).first->second;
    if (rounds_ <= kWarmUp) heldAtStart_[pid] = Holdings::of(pid);
    Holdings now;
    const auto isFlat = [&] {
      now = Holdings::of(pid);
      return now.descriptors <= first.descriptors + kMoreDescriptors &&
             now.mappings <= first.mappings + kMoreMappings &&
             now.heapKiB <= first.heapKiB + kMoreHeapKiB;
    };
    waitFor("the survivors hold no more than they did", isFlat);
  }
}

std::string Referee::holdings() const {
  std::string text;
  for (const auto& [pid, first] : heldAtStart_) {
    const auto now = Holdings::of(pid);
    text +=
        fmt::format("{}{}: {} descriptors (were {}), {} mappings ({}), {} KiB of heap ({})",
                    text.empty() ? "" : "\n",
                    pid == steady_ ? "surviving server" : "surviving client", now.descriptors,
                    first.descriptors, now.mappings, first.mappings, now.heapKiB, first.heapKiB);
  }
  return text;
}

}  // namespace mpf::torture
