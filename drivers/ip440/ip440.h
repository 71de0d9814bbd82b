// SPDX-License-Identifier: MIT
// Ip440: the Acromag IP440, 32 isolated digital inputs. What is on them is read when somebody asks; events and interrupts are not used.
//
//   Ip440 inputs(modules.create("door", "ipac", "IP_c", Ip440::kind()));
//   if (const auto bits = inputs.tryRead()) ...                            // bit 0 is IN00, 1 is on
//
// Threads  any.
// Crash    nothing is ever written to the module.
// Trust    each combination of bits is an input that there may be. A byte that is 0 while there is an IP440 says when to ask the ID PROM.
// Source   Acromag's manual of the 440 series (IOS-440, of the same registers), tables 3.1A, 3.1B and 3.2: 8 inputs in each of the bytes
//          1, 3, 5 and 7 of the I/O space, in the standard mode that reset leaves; bytes that are not used read as 0; ID A3, 10.
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

  // For IndustryPackModules::create().
  [[nodiscard]] static ModuleKind kind() { return {.name = "Acromag IP440", .manufacturer = kAcromag, .models = {kModel}}; }

  // `module` must outlive this.
  explicit Ip440(IndustryPackModule& module) : module_(module), registers_(module.io()) {}

  // All inputs; those of one byte at the same moment. Empty: nothing answers, or another module does.
  [[nodiscard]] std::optional<std::uint32_t> tryRead() noexcept;

 private:
  IndustryPackModule& module_;
  Registers& registers_;
  std::mutex mutex_;      // guards the registers and
  bool isGone_ = false;  // whether it was gone: what is there then must be the right one again
};

}  // namespace mpf
