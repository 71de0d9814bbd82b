// SPDX-License-Identifier: MIT
#include "tools/torture/referee.h"

#include <sys/wait.h>

#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <mpf/backplane.h>
#include <mpf/clock.h>

#include "base/time_text.h"

namespace mpf::torture {
namespace {

constexpr auto kPollInterval = std::chrono::microseconds(500);  // of the actors' reports
constexpr std::uint64_t kEnough = 12;  // replies that show that a process continues
constexpr std::uint64_t kLife = 100;  // replies to the survivor after which a server has run enough
constexpr std::size_t kLinksAtRest = 2;  // of the survivor, to both servers

// How much more a process may hold than in its first rounds: for example a descriptor that it is
// about to close, or a segment for a moment of higher load.
constexpr std::size_t kMoreDescriptors = 4;
constexpr std::size_t kMoreMappings = 16;
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr std::size_t kMoreHeapKiB = SIZE_MAX / 2;  // a sanitizer keeps what was freed
#else
constexpr std::size_t kMoreHeapKiB = 16 * 1024UL;
#endif
constexpr std::uint64_t kWarmUp = 20;  // rounds
// For a condition that a mistake prevents. Without it, the condition becomes true, however late.
constexpr Nanoseconds kPatienceIfBroken = std::chrono::seconds(8);

std::string statusText(int status) {
  if (WIFSIGNALED(status)) return fmt::format("was killed by signal {}", WTERMSIG(status));
  return fmt::format("exited with status {}", WEXITSTATUS(status));
}

bool isOrderly(int status) { return WIFEXITED(status) && WEXITSTATUS(status) == 0; }

}  // namespace

const char* toString(Role role) noexcept { return role == Role::client ? "client" : "server"; }
const char* toString(Mode mode) noexcept { return mode == Mode::kill ? "kill" : "stop"; }

// A process that an actor left (Sabotage::keepName) ends soon after the others. It is not a child
// of this process, so this waits until its segments can be removed.
TemporaryBackplane::~TemporaryBackplane() {
  const auto backplane = Backplane::named(name_);
  const auto patience = Deadline::after(std::chrono::seconds(5));
  do static_cast<void>(backplane.removeDead());
  while (!backplane.segmentNames().empty() && !patience.hasPassed());
}

Referee::Referee(const Marks& marks, const Options& options)
    : marks_(marks), options_(options), random_(options.seed) {
  steady_ = processes_.start([cast = cast()] { return playSteady(cast); });
  survivor_ = processes_.start([cast = cast()] { return playSurvivor(cast); });
  startMortal();
  waitFor("the survivors exchange messages",
          [&] { return repliesOf(0) >= kEnough && repliesOf(1) >= kEnough; });
}

Cast Referee::cast() {
  return {*world_, backplane_.name(), static_cast<std::uint32_t>(random_()), options_.sabotage};
}

void Referee::waitFor(const std::string& what, const Condition& condition, Sabotage brokenBy) {
  auto patience = options_.patience;
  if (brokenBy != Sabotage::none && brokenBy == options_.sabotage)
    patience = std::min(patience, kPatienceIfBroken);
  Nanoseconds waited{0};
  while (!condition()) {
    const auto sinceNs = Clock::nowNs();
    processes_.handleEvents(kPollInterval);
    checkAlive();
    // Counts at most the requested interval: when the processors are so busy that this process
    // waits for one, the actors are not to blame for the delay.
    waited += std::min<Nanoseconds>(Nanoseconds(Clock::nowNs() - sinceNs), kPollInterval);
    if (waited >= patience)
      throw Broken(fmt::format("this did not happen within {}: {}", timeText(patience), what));
  }
}

void Referee::checkAlive() const {
  if (const auto complaint = (*world_).complaint(); !complaint.empty()) throw Broken(complaint);
  if (processes_.hasEnded(survivor_)) throw Broken("the surviving client has ended");
  if (processes_.hasEnded(steady_)) throw Broken("the surviving server has ended");
}

// Runs a process that dies and leaves everything that a dead process can leave.
void Referee::layOutCorpse() {
  const auto corpse = processes_.start([cast = cast()] { return playCorpse(cast); });
  waitFor("a process sends messages to itself and dies",
          [&] { return processes_.hasEnded(corpse); });
  processes_.takeStatus(corpse);
}

void Referee::startMortal() {
  (*world_).mortal.clear();
  mortal_ = processes_.start([cast = cast()] { return playMortal(cast); });
}

void Referee::endMortal() {
  const auto& disconnects = (*world_).survivor.talked[1].disconnects;
  const auto before = disconnects.load();
  (*world_).mortal.leave.store(1);
  waitFor("the server exits, and its client is disconnected",
          [&] { return processes_.hasEnded(mortal_) && disconnects.load() != before; });
  const auto status = processes_.takeStatus(std::exchange(mortal_, 0));
  if (!isOrderly(status))
    throw Broken(fmt::format("the server that was asked to exit {}", statusText(status)));
}

// Starts the process under test, under ptrace, and its companion.
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
  processes_.openGate();
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
  waitFor(fmt::format("the {} reaches its place or exchanges enough messages", toString(plan.role)),
          [&] { return victim.isThere() || victim.isGone() || isLifeDone(plan.role); });
  if (!victim.isThere()) {
    boardOf(plan.role).leave.store(1);
    waitFor(fmt::format("the {} exits", toString(plan.role)),
            [&] { return victim.isThere() || victim.isGone(); });
  }
  wasThere_ = victim.isThere();
  if (wasThere_ && plan.mode == Mode::kill) {
    victim.kill();
    waitFor("the killed process ends", [&] { return victim.isGone(); });
  } else {
    if (wasThere_) hold(plan.role);
    waitFor(fmt::format("the {} continues after its stop", toString(plan.role)),
            [&] { return victim.isGone() || isLifeDone(plan.role); });
    boardOf(plan.role).leave.store(1);
    waitFor(fmt::format("the {} exits", toString(plan.role)), [&] { return victim.isGone(); });
    checkOrderlyEnd(plan.role);
  }
  processes_.setTracee(nullptr);
  processes_.takeStatus(victim.pid());
  processes_.kill(std::exchange(companion_, 0));
  if (plan.role == Role::server) startMortal();
}

void Referee::checkOrderlyEnd(Role role) const {
  if (isOrderly(tracee_->status())) return;
  throw Broken(fmt::format("the {} {}, although the referee had not killed it", toString(role),
                           statusText(tracee_->status())));
}

// Checks that the survivors continue while the process under test is stopped, and that they do not
// take it for dead. Then resumes it.
void Referee::hold(Role role) {
  auto& survivor = (*world_).survivor;
  // A server that was told to leave may disconnect its clients with another thread than the stopped
  // one.
  const auto& board = boardOf(role);
  const bool leaving = board.leave.load() != 0 || board.isLeaving.load() != 0;
  const auto disconnects = survivor.talked[1].disconnects.load();
  const auto died = role == Role::client ? clientsDied(backplane_.name(), "steady") : 0;
  const auto replies = repliesOf(0);
  waitFor("the survivors continue while a process is stopped",
          [&] { return repliesOf(0) - replies >= kEnough; });
  if (!leaving && survivor.talked[1].disconnects.load() != disconnects)
    throw Broken("a server that was only stopped was reported as dead");
  if (role == Role::client && clientsDied(backplane_.name(), "steady") != died)
    throw Broken("a client that was only stopped was reported as dead");
  tracee_->release();
}

// Replies alone do not show that the survivor has the successor: replies of the dead server may
// arrive late.
void Referee::awaitSuccessor() {
  const auto& server = (*world_).survivor.talked[1].server;
  const auto& incarnation = (*world_).mortal.incarnation;
  waitFor("the successor has the name of the dead server, and its client", [&] {
    if (processes_.hasEnded(mortal_))
      throw Broken("the successor could not open the name of the dead server");
    return incarnation.load() != 0 && incarnation.load() == server.load();
  });
  const auto replies = repliesOf(1);
  waitFor("the successor answers", [&] { return repliesOf(1) - replies >= kEnough; });
}

// Lets all actors rest and checks that everything holds.
void Referee::settle() {
  auto& survivor = (*world_).survivor;
  const auto steadyReplies = repliesOf(0);
  waitFor("the survivors continue", [&] { return repliesOf(0) - steadyReplies >= kEnough; });
  awaitSuccessor();
  survivor.rest.store(1);
  waitFor(
      "each request has an end", [&] { return survivor.isAtRest.load() != 0; }, Sabotage::loseFate);
  std::vector<std::string> stale;
  try {
    waitFor(
        "nothing stale is left",
        [&] {
          static_cast<void>(Backplane::named(backplane_.name()).removeDead());
          return (stale = staleSegments(backplane_.name(), kLinksAtRest)).empty();
        },
        Sabotage::stale);
  } catch (const Broken& broken) {
    throw Broken(fmt::format("{}; still there: {}", broken.what(), fmt::join(stale, ", ")));
  }
  // A death that it notices later would count in the next round.
  waitFor("the surviving server has closed the links of others than the survivor",
          [&] { return openLinks(backplane_.name(), "steady") == 1; });
  checkNoProtocolErrors(backplane_.name());
  checkHoldings();
  survivor.rest.store(0);
  waitFor("the survivors continue after a rest", [&] { return survivor.isAtRest.load() == 0; });
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
    waitFor("the survivors hold no more resources than in the first rounds", isFlat,
            Sabotage::leak);
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
