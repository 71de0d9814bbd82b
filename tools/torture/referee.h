// SPDX-License-Identifier: MIT
// Referee: plays rounds. In each round it stops or kills one process at a chosen place, and then
// checks that everything holds.
//
//   before   a corpse leaves stale segments, and a companion starts that will kill itself
//   stop     the survivors continue, and no process takes the stopped one for dead; then it resumes
//            and exits
//   kill     a successor can use the dead server's name at once, and gets its client
//   after    each request has ended once, nothing stale is left, the survivors hold no more
//            resources than in the first rounds
//
// Threads  one.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <string>

#include <mpf/backplane.h>
#include <mpf/clock.h>

#include "tools/torture/actors.h"
#include "tools/torture/checks.h"
#include "tools/torture/processes.h"

namespace mpf::torture {

enum class Role { client, server };  // of the process under test
enum class Mode { kill, stop };
[[nodiscard]] const char* toString(Role role) noexcept;
[[nodiscard]] const char* toString(Mode mode) noexcept;

struct Plan {
  Role role{};
  Mode mode{};
  Place place;
};

struct Outcome {
  bool reached = false;  // false: the process ended before it reached the place
  bool cameToNextMark = false;  // stopped at the next step, before all instructions were executed
};

// An isolated backplane, whose segments are removed at the end, after their processes have ended.
class TemporaryBackplane {
 public:
  TemporaryBackplane() : name_(Backplane::isolated().name()) {}
  ~TemporaryBackplane();
  TemporaryBackplane(const TemporaryBackplane&) = delete;
  TemporaryBackplane& operator=(const TemporaryBackplane&) = delete;
  [[nodiscard]] const std::string& name() const noexcept { return name_; }

 private:
  std::string name_;
};

class Referee {
 public:
  struct Options {
    std::uint32_t seed = 0;
    Nanoseconds patience = std::chrono::seconds(30);  // longest wait for anything that must happen
    Sabotage sabotage = Sabotage::none;
  };
  // Starts the survivors on a new isolated backplane. At the end all actors are killed, and the
  // segments that they left are removed.
  //   throws  Broken when the survivors do not exchange messages
  Referee(const Marks& marks, const Options& options);
  Referee(const Referee&) = delete;
  Referee& operator=(const Referee&) = delete;

  // Plays one round.
  //   throws  Broken when an invariant does not hold
  Outcome play(const Plan& plan);
  // Plays a round in which no process is stopped or killed. Returns how often each of these steps
  // is reached.
  std::map<std::string, std::uint64_t> reconnoitre(Role role, const std::set<std::string>& marks);
  // The resources that the survivors hold, as text.
  [[nodiscard]] std::string holdings() const;

 private:
  using Condition = std::function<bool()>;
  // `brokenBy`: the mistake after which this condition does not become true.
  void waitFor(const std::string& what, const Condition& condition,
               Sabotage brokenBy = Sabotage::none);
  [[nodiscard]] Cast cast();
  void layOutCorpse();
  void startMortal();
  void endMortal();
  void live(Role role, const std::function<void(Tracee&)>& prepare);
  void torment(const Plan& plan);
  void hold(Role role);
  void checkOrderlyEnd(Role role) const;
  [[nodiscard]] bool isLifeDone(Role role) const;
  void settle();
  void awaitSuccessor();
  void checkHoldings();
  void checkAlive() const;
  [[nodiscard]] Board& boardOf(Role role) const {
    return role == Role::client ? (*world_).visitor : (*world_).mortal;
  }
  [[nodiscard]] std::uint64_t repliesOf(std::size_t server) const {
    return (*world_).survivor.talked[server].replies.load();
  }

  const Marks& marks_;
  Options options_;
  std::mt19937 random_;
  // In this order, also when the constructor throws: the processes end, then the files are removed.
  TemporaryBackplane backplane_;
  SharedWorld world_;
  Processes processes_;
  pid_t survivor_ = 0;
  pid_t steady_ = 0;
  pid_t mortal_ = 0;
  pid_t companion_ = 0;  // the guest or the fleeting server of this round
  std::unique_ptr<Tracee> tracee_;
  bool wasThere_ = false;
  std::uint64_t mortalReplies_ = 0;  // replies of mortal servers before the one under test
  std::uint64_t rounds_ = 0;
  std::map<pid_t, Holdings> heldAtStart_;
};

}  // namespace mpf::torture
