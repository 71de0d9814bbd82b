// SPDX-License-Identifier: MIT
// Ip440: driver of the Acromag IP440, a module with 32 isolated digital inputs. It reads the inputs
// on request; it does not use the module's events and interrupts.
//
//   Ip440 inputs(modules.create("door", "ipac", "IP_c", Ip440::kind()));
//   if (const auto bits = inputs.tryRead()) ...     // bit 0 is IN00; 1 is on
//
// Threads  any number of callers at a time.
// Crash    the driver never writes to the module, so a crash leaves nothing behind.
// Trust    every combination of input bits is valid. An unused byte, which reads as 0 while an
//          IP440 is present, shows when the ID PROM must be read again.
// Source   Acromag's manual of the 440 series (IOS-440, which has the same registers), tables 3.1A,
//          3.1B and 3.2: 8 inputs in each of the bytes 1, 3, 5 and 7 of the I/O space, in the
//          standard mode, which is the mode after a reset; unused bytes read as 0; ID A3, 10.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>

#include <mpf/drivers/industry_pack/module.h>

namespace mpf {

class Ip440 {
 public:
  static constexpr int kInputs = 32;
  static constexpr std::uint16_t kModel = 0x10;

  // The ID PROM that IndustryPackModules::create() requires.
  [[nodiscard]] static ModuleKind kind() {
    return {.name = "Acromag IP440", .manufacturer = kAcromag, .models = {kModel}};
  }

  // `module` must outlive this object.
  explicit Ip440(IndustryPackModule& module) : module_(module), registers_(module.io()) {}

  // Reads all inputs. The eight inputs of a byte are read at the same moment, the bytes one by one.
  //
  //   returns   bit n = input n (IN00 to IN31), 1 is on; nullopt when the module is absent or
  //             replaced
  [[nodiscard]] std::optional<std::uint32_t> tryRead() noexcept;

 private:
  IndustryPackModule& module_;
  Registers& registers_;
  std::mutex mutex_;  // guards the registers and isGone_
  bool isGone_ = false;  // the last read failed: the next one checks the ID PROM first
};

}  // namespace mpf
