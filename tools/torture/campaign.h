// SPDX-License-Identifier: MIT
// Campaign: which rounds are played: each step in each role killed and stopped once, then random
// places for as long as was asked for.
//
// Threads  one. SIGINT and SIGTERM end it after the round, with the verdict so far.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "tools/torture/tally.h"

namespace mpf::torture {

struct CampaignOptions {
  Referee::Options referee;
  std::chrono::duration<double> duration{60};
  std::vector<std::string> steps;  // empty: all
  std::optional<Role> role;  // empty: both
  std::optional<Mode> mode;  // empty: both
  std::optional<std::uint64_t> hit;
  std::optional<std::uint64_t> instructions;
  bool everyInstruction = false;
};

class Campaign {
 public:
  // Called before each round: which, how many so far, and how many are planned (0: until the time
  // is over).
  using Progress =
      std::function<void(const Plan& plan, std::uint64_t round, std::uint64_t planned)>;

  Campaign(const Marks& marks, CampaignOptions options, Progress progress);
  // Plays it all, or up to the first failure.
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
  std::map<Role, Hits> hits_;  // in a life without torment, of the steps asked for
  std::vector<Plan> places_;  // each step in each role and mode that comes there
  std::optional<Plan> playing_;
  Outcome last_;
  Tally tally_;
};

}  // namespace mpf::torture
