// SPDX-License-Identifier: MIT
// Random: numbers that differ in each run. A run prints its seed, and the environment variable
// MPF_TEST_SEED repeats the run.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <random>

namespace mpf::test {

class Random {
 public:
  Random() : engine_(chosenSeed()) {}

  // 0 to end - 1.
  std::uint64_t below(std::uint64_t end) { return engine_() % end; }
  bool oneIn(std::uint64_t n) { return below(n) == 0; }
  std::uint64_t bits() { return engine_(); }
  // Numbers of all magnitudes; the limits of integer types are more frequent than others.
  std::uint64_t nasty() {
    const auto power = std::uint64_t{1} << below(64);
    return oneIn(3) ? power - 1 + below(3) : engine_() >> below(64);
  }

 private:
  static std::uint64_t chosenSeed() {
    const char* set = std::getenv("MPF_TEST_SEED");
    const auto seed = set != nullptr ? std::strtoull(set, nullptr, 10) : std::random_device()();
    std::cout << "seed " << seed << '\n';
    return seed;
  }
  std::mt19937_64 engine_;
};

}  // namespace mpf::test
