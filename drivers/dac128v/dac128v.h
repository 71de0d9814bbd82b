// SPDX-License-Identifier: MIT
// Dac128v: the Systran DAC128V, eight outputs of 12 bits (manual, "Systran DAC128V Support").
//
//   Dac128v dac(modules.create("dac", "ipac", "IP_b", Dac128v::kind()));
//   if (dac.tryWrite(3, 2048) != Dac128vStatus::success) ...
//
// Each write is read back: what the register does not hold is not on the output. Nothing is written at start, so outputs stay as they
// were while a program ends and another begins; after power-up that is code 2048, the middle of the range.
//
// A module that was reset, or pulled out and put back, is found by the next write: a register that was written holds something else.
// If its ID PROM is the right one, all channels get what was written to them last; if not, nothing is written.
//
// Threads  any; a write and its read-back are not interrupted by another thread's.
// Crash    outputs stay as they are.
// Trust    what the module says is compared, nothing else. The upper four bits of a register may be anything; all ones, which code 4095 may
//          read as, and what is not as it was left, make the ID PROM be asked who is there.
// Source   one word for each channel from offset 0 of the I/O space, to write and to read.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>

#include <mpf/drivers/dac128v/dac128v_range.h>
#include <mpf/drivers/industry_pack/module.h>

namespace mpf {

enum class Dac128vStatus : std::uint8_t {
  success,
  noChannel,  // not 0 to 7; nothing was written
  outOfRange,  // not 0 to 4095; nothing was written
  readBackDiffers,  // the register holds something else than was written
  gone,  // nothing answers, or another module does; that was not written to
};
[[nodiscard]] const char* toString(Dac128vStatus status) noexcept;
// Whether that is the module's fault, not the caller's.
[[nodiscard]] constexpr bool isFault(Dac128vStatus status) noexcept {
  return status == Dac128vStatus::readBackDiffers || status == Dac128vStatus::gone;
}

class Dac128v {
 public:
  static constexpr int kChannels = 8;
  static constexpr int kChannelsInGroup = 4;
  static constexpr int kMaxCode = Dac128vRange::kCodes - 1;
  static constexpr int kPowerUpCode = Dac128vRange::kCodes / 2;

  // For IndustryPackModules::create().
  [[nodiscard]] static ModuleKind kind() { return {.name = "Systran DAC128V", .manufacturer = kSystran, .models = {0x69}}; }

  // `module` must outlive this.
  explicit Dac128v(IndustryPackModule& module) : module_(module), registers_(module.io()) {}

  [[nodiscard]] Dac128vStatus tryWrite(int channel, int code) noexcept;
  // The code that the register holds; empty when there is no such channel or the module is gone.
  [[nodiscard]] std::optional<int> tryRead(int channel) noexcept;
  // How often the module had lost what was written, and got it again.
  [[nodiscard]] std::uint64_t restorations() const noexcept { return restorations_.load(std::memory_order_relaxed); }

 private:
  [[nodiscard]] bool isReady() noexcept;
  [[nodiscard]] bool holdsWhatWasWritten() noexcept;
  [[nodiscard]] bool tryRestore() noexcept;
  [[nodiscard]] std::optional<int> writeAndReadBack(std::size_t channel, int code) noexcept;

  IndustryPackModule& module_;
  Registers& registers_;
  std::mutex mutex_;  // guards the registers and
  std::array<std::optional<int>, kChannels> written_;  // what they hold since a write
  std::atomic<std::uint64_t> restorations_{0};
};

}  // namespace mpf
