// SPDX-License-Identifier: MIT
#include "tools/torture/campaign.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <set>
#include <utility>

#include "base/stop_signals.h"

namespace mpf::torture {
namespace {

constexpr int kTries = 20;  // for a step that a process does not reach in every run
constexpr double kMaxInstructions = 5000;  // after a step

std::atomic<bool>& interrupted() {
  static std::atomic<bool> interrupted{false};
  return interrupted;
}

}  // namespace

Campaign::Campaign(const Marks& marks, CampaignOptions options, Progress progress)
    : marks_(marks),
      options_(std::move(options)),
      progress_(std::move(progress)),
      random_(options_.referee.seed) {
  tally_.seed = options_.referee.seed;
  for (const auto& [mark, addresses] : marks_.byName()) {
    if (options_.steps.empty() || std::ranges::find(options_.steps, mark) != options_.steps.end())
      tally_.marks[mark] = {};
  }
}

Tally Campaign::run() {
  const StopSignals stop(
      [](void* flag) noexcept { static_cast<std::atomic<bool>*>(flag)->store(true); },
      &interrupted());
  try {
    Referee referee(marks_, options_.referee);
    play(referee);
    tally_.holdings = referee.holdings();
  } catch (const Broken& broken) {
    tally_.failure = {broken.what(), playing_};
  }
  tally_.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  return tally_;
}

void Campaign::play(Referee& referee) {
  for (int tries = 0; tries < kTries && !isAllFound(); ++tries) {
    for (const auto role : roles()) reconnoitre(referee, role);
  }
  for (const auto& [role, marks] : hits_) {
    for (const auto& [mark, hits] : marks) {
      for (const auto mode : modes())
        places_.push_back(
            {role, mode, {mark, options_.hit.value_or(1), options_.instructions.value_or(0)}});
    }
  }
  if (options_.everyInstruction) return playEveryInstruction(referee);
  playOnce(referee);
  playRandomly(referee);
}

void Campaign::reconnoitre(Referee& referee, Role role) {
  std::set<std::string> wanted;
  for (const auto& [mark, tally] : tally_.marks) wanted.insert(mark);
  for (const auto& [mark, hits] : referee.reconnoitre(role, wanted))
    hits_[role][mark] = std::max(hits_[role][mark], hits);
}

// Whether a process reaches each step that the user asked for.
bool Campaign::isAllFound() const {
  return std::ranges::all_of(tally_.marks, [&](const auto& mark) {
    return std::ranges::any_of(
        hits_, [&](const auto& ofRole) { return ofRole.second.contains(mark.first); });
  });
}

void Campaign::playOnce(Referee& referee) {
  for (const auto& plan : places_) {
    for (int tries = 0;
         tries < kTries && !interrupted() && !tryRound(referee, plan, places_.size()); ++tries)
      continue;
  }
}

void Campaign::playEveryInstruction(Referee& referee) {
  for (auto plan : places_) {
    plan.place.upToNextMark = true;
    int missed = 0;
    last_ = {};
    while (!interrupted() && !last_.cameToNextMark && missed < kTries) {
      missed = tryRound(referee, plan, 0) ? 0 : missed + 1;
      if (missed == 0) ++plan.place.instructions;
    }
  }
}

void Campaign::playRandomly(Referee& referee) {
  while (!places_.empty() && !isOver()) tryRound(referee, randomPlan(), 0);
}

// A random place; places near a step are more likely than places far from it.
Plan Campaign::randomPlan() {
  auto plan = places_[random_() % places_.size()];
  if (!options_.hit) plan.place.hit = 1 + random_() % hits_[plan.role][plan.place.mark];
  if (!options_.instructions) {
    const auto share = std::uniform_real_distribution<double>(0, 1)(random_);
    plan.place.instructions = static_cast<std::uint64_t>(std::pow(kMaxInstructions, share)) - 1;
  }
  return plan;
}

// False when the process under test ended before it reached the place.
bool Campaign::tryRound(Referee& referee, const Plan& plan, std::uint64_t planned) {
  playing_ = plan;
  progress_(plan, ++tally_.rounds, planned);
  last_ = referee.play(plan);
  if (last_.reached) tally_.note(plan);
  return last_.reached;
}

std::vector<Role> Campaign::roles() const {
  return options_.role ? std::vector{*options_.role} : std::vector{Role::client, Role::server};
}

std::vector<Mode> Campaign::modes() const {
  return options_.mode ? std::vector{*options_.mode} : std::vector{Mode::kill, Mode::stop};
}

bool Campaign::isOver() const {
  return interrupted() || std::chrono::steady_clock::now() - begin_ >= options_.duration;
}

}  // namespace mpf::torture
