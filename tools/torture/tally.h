// SPDX-License-Identifier: MIT
// Tally: how many rounds were played at each step, and the verdict.
//
// Threads  one.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tools/torture/referee.h"

namespace mpf::torture {

// Number of rounds at one step: [role][mode].
using Played = std::array<std::array<std::uint64_t, 2>, 2>;

struct Failure {
  std::string what;
  std::optional<Plan> plan;  // of the round; nullopt: no process was stopped or killed in it
};

struct Tally {
  std::uint32_t seed = 0;
  double seconds = 0;
  std::uint64_t rounds = 0;
  std::map<std::string, Played> marks;  // each step that the user asked for
  std::optional<Failure> failure;
  std::string holdings;

  void note(const Plan& plan) {
    ++marks.at(
        plan.place.mark)[static_cast<std::size_t>(plan.role)][static_cast<std::size_t>(plan.mode)];
  }
  [[nodiscard]] std::vector<std::string> neverReached() const;
  // "held", "incomplete" (a step was never reached), "failed".
  [[nodiscard]] std::string verdict() const;
  // The report as text: a row for each step, the steps that were never reached, the verdict, and
  // how to repeat a failure.
  [[nodiscard]] std::string text() const;
  [[nodiscard]] nlohmann::json json() const;
};

// The command that repeats a round.
[[nodiscard]] std::string commandOf(const Plan& plan);

}  // namespace mpf::torture
