// SPDX-License-Identifier: MIT
// Dac128v: driver of the Systran DAC128V, a module with eight analog outputs of 12 bits (manual,
// "Systran DAC128V Support").
//
//   Dac128v dac(modules.create("dac", "ipac", "IP_b", Dac128v::kind()));
//   if (dac.tryWrite(3, 2048) != Dac128vStatus::success) ...
//
// Each write is read back, so a register that does not store the code is detected. The constructor
// writes nothing: the outputs keep their values when one program ends and another starts. After
// power-up they have code 2048, the middle of the range.
//
// A module that was reset, or pulled out and put back, is detected by the next write, because a
// register that was written holds another code. If the ID PROM is the right one, each channel gets
// its last written code again; if not, nothing is written.
//
// Threads  any number of callers at a time; a write and its read-back are one step.
// Crash    the outputs keep their values.
// Trust    values that the module returns are only compared. The upper four bits of a register may
//          be anything. The ID PROM is read again when a register reads as all ones (which code
//          4095 may also do) or has changed unexpectedly.
// Source   Systran DAC128V: one 16-bit word for each channel from offset 0 of the I/O space,
//          readable and writable.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>

#include <mpf/drivers/dac128v_range.h>
#include <mpf/drivers/industry_pack/module.h>

namespace mpf {

enum class Dac128vStatus : std::uint8_t {
  success,
  noChannel,  // the channel is not 0 to 7; nothing was written
  outOfRange,  // the code is not 0 to 4095; nothing was written
  readBackDiffers,  // the register does not hold the written code
  gone,  // the module is absent, or another module is in its place and was not written to
};
// A sentence for messages to people.
[[nodiscard]] const char* toString(Dac128vStatus status) noexcept;
// Returns true for a fault of the module, false for success and for errors of the caller.
[[nodiscard]] constexpr bool isFault(Dac128vStatus status) noexcept {
  return status == Dac128vStatus::readBackDiffers || status == Dac128vStatus::gone;
}

class Dac128v {
 public:
  static constexpr int kChannels = 8;
  static constexpr int kChannelsInGroup = 4;  // channels with a common range
  static constexpr int kMaxCode = Dac128vRange::kCodes - 1;
  static constexpr int kPowerUpCode = Dac128vRange::kCodes / 2;

  // The ID PROM that IndustryPackModules::create() requires.
  [[nodiscard]] static ModuleKind kind() {
    return {.name = "Systran DAC128V", .manufacturer = kSystran, .models = {0x69}};
  }

  // Writes nothing. `module` must outlive this object.
  explicit Dac128v(IndustryPackModule& module) : module_(module), registers_(module.io()) {}

  // Sets an output and reads the register back.
  //
  //   channel   0 to 7
  //   code      0 to 4095; Dac128vRange converts between codes and volts
  //   returns   success once the register holds the code
  [[nodiscard]] Dac128vStatus tryWrite(int channel, int code) noexcept;
  // Returns the code in the register, 0 to 4095; nullopt when the channel is not 0 to 7, or the
  // module is absent or replaced.
  [[nodiscard]] std::optional<int> tryRead(int channel) noexcept;
  // How often the outputs were restored after a reset of the module.
  [[nodiscard]] std::uint64_t restorations() const noexcept {
    return restorations_.load(std::memory_order_relaxed);
  }

 private:
  [[nodiscard]] bool isReady() noexcept;
  [[nodiscard]] bool holdsWhatWasWritten() noexcept;
  [[nodiscard]] bool tryRestore() noexcept;
  [[nodiscard]] std::optional<int> writeAndReadBack(std::size_t channel, int code) noexcept;

  IndustryPackModule& module_;
  Registers& registers_;
  std::mutex mutex_;  // guards the registers and written_
  // the last code that each register has stored
  std::array<std::optional<int>, kChannels> written_;
  std::atomic<std::uint64_t> restorations_{0};
};

}  // namespace mpf
