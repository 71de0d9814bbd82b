// SPDX-License-Identifier: MIT
// Campaign: chooses the rounds of `mpf torture`. First it kills and stops each role once at each
// step, then at random places until the time is over.
//
// Threads  one. SIGINT and SIGTERM end it after the current round, with the verdict so far.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <mpf/clock.h>

#include "tools/torture/tally.h"

namespace mpf::torture {

struct CampaignOptions {
  Referee::Options referee;
  Nanoseconds duration = std::chrono::seconds(60);
  std::vector<std::string> steps;  // empty: all
  std::optional<Role> role;  // empty: both
  std::optional<Mode> mode;  // empty: both
  std::optional<std::uint64_t> hit;
  std::optional<std::uint64_t> instructions;
  bool everyInstruction = false;
};

class Campaign {
 public:
  // Called before each round, with its plan, its number and the number of planned rounds (0: until
  // the time is over).
  using Progress =
      std::function<void(const Plan& plan, std::uint64_t round, std::uint64_t planned)>;

  Campaign(const Marks& marks, CampaignOptions options, Progress progress);
  // Plays all rounds, or up to the first failure.
  Tally run();

 private:
  using Hits = std::map<std::string, std::uint64_t>;
  void play(Referee& referee);
  void reconnoitre(Referee& referee, Role role);
  [[nodiscard]] bool isAllFound() const;
  void playOnce(Referee& referee);
  void playEveryInstruction(Referee& referee);
  void playRandomly(Referee& referee);
  bool tryRound(Referee& referee, const Plan& plan, std::uint64_t planned);
  [[nodiscard]] Plan randomPlan();
  [[nodiscard]] std::vector<Role> roles() const;
  [[nodiscard]] std::vector<Mode> modes() const;
  [[nodiscard]] bool isOver() const;

  const Marks& marks_;
  CampaignOptions options_;
  Progress progress_;
  std::mt19937 random_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  // How often an undisturbed process reaches each chosen step.
  std::map<Role, Hits> hits_;
  std::vector<Plan> places_;  // each chosen step, in each role that reaches it, in each mode
  std::optional<Plan> playing_;
  Outcome last_;
  Tally tally_;
};

}  // namespace mpf::torture
