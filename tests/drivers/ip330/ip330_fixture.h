// SPDX-License-Identifier: MIT
// Ip330Board: a driver with its device model, which scans on request. Notes: the reported faults.
#pragma once

#include <gtest/gtest.h>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <mpf/drivers/industry_pack/model_carrier.h>

#include "drivers/ip330/ip330.h"
#include "drivers/ip330/ip330_model.h"
#include "tests/support/watchdog.h"

namespace mpf::test {

using namespace std::chrono_literals;

// Records the calls of a fault hook. Threads: any.
class Notes {
 public:
  Ip330Faults::Hook hook() {
    return [this](const std::string& text, bool isThere) {
      const std::lock_guard lock(mutex_);
      texts_.push_back((isThere ? "+" : "-") + text);
    };
  }
  void waitFor(const std::string& part) {
    while (!has(part)) std::this_thread::yield();
  }
  bool has(const std::string& part) {
    const std::lock_guard lock(mutex_);
    for (const auto& text : texts_) {
      if (text.find(part) != std::string::npos) return true;
    }
    return false;
  }

 private:
  std::mutex mutex_;
  std::vector<std::string> texts_;
};

// Limits for tests without timing: no polling, and no wait that ends while the test is delayed.
inline constexpr Ip330Limits kPatient{.conversion = 1h,
                                      .silence = 1h,
                                      .lookEvery = 1h,
                                      .pollEvery = 0ms,
                                      .stormLimit = 16,
                                      .stormPause = 1h};
// Limits with which faults are noticed soon.
inline constexpr Ip330Limits kWatchful{.conversion = 10ms,
                                       .silence = 50ms,
                                       .lookEvery = 1ms,
                                       .pollEvery = 1ms,
                                       .stormLimit = 16,
                                       .stormPause = 5ms};

struct Ip330Board {
  explicit Ip330Board(const Ip330Settings& settings,
                      const Ip330ModelOptions& options = {.isRealTime = false},
                      const Ip330Limits& limits = kPatient)
      : model(carrier.plug("IP_a", std::make_unique<Ip330Model>(options))),
        module("adc", "a model", carrier.site(0), kIp330),
        board(module, settings, notes.hook(), limits) {}

  // Runs scans; waits after each until the driver has taken it.
  void scan(int scans = 1) {
    for (; scans > 0; --scans) {
      const auto before = board.counters().scans;
      model.step();
      while (board.counters().scans == before) std::this_thread::yield();
    }
  }

  Watchdog watchdog{"ip330 test"};
  Notes notes;
  ModelCarrier carrier;
  Ip330Model& model;
  IndustryPackModule module;
  Ip330 board;
};

}  // namespace mpf::test
