// SPDX-License-Identifier: MIT
// Referee: plays rounds. In each, one process is stopped or killed at a chosen place, and
// afterwards everything must hold.
//
//   before    a corpse is left for the tormented to find, and somebody who will die on it
//   at the place, stopped   the survivors go on, and nobody takes it for dead; then it goes on, to
//   an orderly end at the place, killed    a successor has its name at once and gets its client
//   after     every request has had one end, nothing stale is left, the survivors hold what they
//             held
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

#include "tools/torture/actors.h"
#include "tools/torture/checks.h"
#include "tools/torture/processes.h"

namespace mpf::torture {

enum class Role { client, server };  // of the tormented
enum class Mode { kill, stop };
[[nodiscard]] const char* toString(Role role) noexcept;
[[nodiscard]] const char* toString(Mode mode) noexcept;

struct Plan {
  Role role{};
  Mode mode{};
  Place place;
};

struct Outcome {
  bool reached = false;  // else it ended before it came there
  bool cameToNextMark = false;  // and not so far behind the mark as was asked for
};

class Referee {
 public:
  struct Options {
    std::uint32_t seed = 0;
    std::chrono::duration<double> patience{30};  // for anything that must happen
    Sabotage sabotage = Sabotage::none;
  };
  // Starts the survivors on a backplane of its own.
  Referee(const Marks& marks, const Options& options);
  // Ends everybody and removes what they left.
  ~Referee();
  Referee(const Referee&) = delete;
  Referee& operator=(const Referee&) = delete;

  // One round.
  //   throws  Broken when something does not hold
  Outcome play(const Plan& plan);
  // A round in which nobody is tormented: how often each of these steps is reached.
  std::map<std::string, std::uint64_t> reconnoitre(Role role, const std::set<std::string>& marks);
  [[nodiscard]] std::uint64_t rounds() const noexcept { return rounds_; }
  // What the survivors hold, in words.
  [[nodiscard]] std::string holdings() const;

 private:
  using Condition = std::function<bool()>;
  void waitFor(const std::string& what, const Condition& condition);
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
  std::string backplane_;
  std::mt19937 random_;
  SharedWorld world_;
  Processes processes_;
  pid_t survivor_ = 0;
  pid_t steady_ = 0;
  pid_t mortal_ = 0;
  pid_t companion_ = 0;  // the guest or the fleeting server of this round
  std::unique_ptr<Tracee> tracee_;
  bool wasThere_ = false;
  std::uint64_t mortalReplies_ = 0;  // when this life of the mortal server began
  std::uint64_t rounds_ = 0;
  std::map<pid_t, Holdings> heldAtStart_;
};

}  // namespace mpf::torture
