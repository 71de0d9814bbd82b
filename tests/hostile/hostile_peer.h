// SPDX-License-Identifier: MIT
// HostilePeer: a hostile process. HostileTest: a test with one kind of hostile process.
#pragma once

#include <atomic>
#include <cstdlib>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>
#include <thread>

#include "tests/support/test_backplane.h"
#include "tests/support/usage.h"
#include "tests/support/victim.h"
#include "tests/support/watchdog.h"

namespace mpf::test {

class HostilePeer {
 public:
  HostilePeer(const std::string& side, const std::string& backplane, const std::string& kind)
      : process_(MPF_TEST_HOSTILE, std::vector{side, backplane, kind}),
        listener_([this] { listen(); }) {}
  ~HostilePeer() {
    process_.signal(SIGKILL);
    listener_.join();
  }
  HostilePeer(const HostilePeer&) = delete;
  HostilePeer& operator=(const HostilePeer&) = delete;

  // Whether it has performed enough attacks.
  [[nodiscard]] bool hasActed() const noexcept { return hasActed_; }
  // Whether it exited before that.
  [[nodiscard]] bool hasFailed() const noexcept { return hasFailed_; }

 private:
  void listen() {
    auto line = process_.line();
    while (!line.empty() && line != "hostile") line = process_.line();
    (line.empty() ? hasFailed_ : hasActed_) = true;
  }
  Victim process_;
  std::atomic<bool> hasActed_{false};
  std::atomic<bool> hasFailed_{false};
  std::thread listener_;
};

class HostileTest : public testing::TestWithParam<const char*> {
 protected:
  static constexpr std::size_t kSlackKb = 4096;
  static int seeds() {
    const char* set = std::getenv("MPF_TEST_SEEDS");
    return set != nullptr ? std::atoi(set) : 1;
  }

  Watchdog watchdog_{testing::UnitTest::GetInstance()->current_test_info()->name()};
  TestBackplane backplane_;
};

inline constexpr const char* kAttacks[] = {"bytes", "words",     "slots", "hints", "headers",
                                           "cut",   "backwards", "flood", "slow"};

}  // namespace mpf::test
