// SPDX-License-Identifier: MIT
// PulseCounter: driver of an Industry Pack module with eight pulse counters. The module is invented
// for this example; a driver of a real one differs in its registers only.
//
//   | 0x00 count 0, high | 0x02 count 0, low | ... | 0x1e count 7, low | 0x20 clear: one bit each |
//
// Reading the high half of a count latches the low half, so that both halves are of one count.
//
// Threads  any number of callers at a time.
// Crash    the module continues to count; nothing is lost.
// Trust    a count may be any number. An absent module reads as all ones, so the driver checks the
//          ID PROM when a count is all ones.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>

#include <mpf/drivers/industry_pack/module.h>

class PulseCounter {
 public:
  static constexpr std::uint32_t kManufacturer = 0x7e;
  static constexpr std::uint16_t kModel = 0x01;
  static constexpr int kChannels = 8;
  static constexpr std::size_t kClear = 0x20;

  // The ID PROM that mpf::IndustryPackModules::create() requires.
  static mpf::ModuleKind kind() {
    return {.name = "pulse counter", .manufacturer = kManufacturer, .models = {kModel}};
  }

  // `module` must outlive this object.
  explicit PulseCounter(mpf::IndustryPackModule& module) : module_(module) {}

  //   channel   0 to 7
  //   returns   pulses since the channel was cleared, modulo 2^32; nullopt for another channel, and
  //             when the module is absent or replaced
  [[nodiscard]] std::optional<std::uint32_t> tryRead(int channel);
  //   returns   false in the cases in which tryRead() returns nullopt
  [[nodiscard]] bool tryClear(int channel);

 private:
  [[nodiscard]] static bool isChannel(int channel) { return channel >= 0 && channel < kChannels; }

  mpf::IndustryPackModule& module_;
  std::mutex mutex_;  // held while the two halves of a count are read
};
