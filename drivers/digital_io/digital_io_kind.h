// SPDX-License-Identifier: MIT
// DigitalIoKind: the properties of each supported model of digital I/O module, GreenSpring
// IP-Unidig and Systran DIO316I.
//
// Bits are numbered as in the registers: bit 0 is the lowest of the low word, bit 16 the lowest of
// the high one.
//
// Source  IP-Unidig, 16-bit words from the start of the I/O space:
//           0, 1  outputs           6     control             b, c  polarity (1: rising edge)
//           2, 3  inputs            8     interrupt vector    d, e  pending edges
//           4, 5  output enable     9, a  interrupt enable    e     DAC of the comparator, -HV
//                                                                   models
//         Writing ones clears pending edges. The first EPICS driver had the low output enable at 8,
//         which is the vector; 4 is right.
//         DIO316I: 0, 1 outputs; 2 inputs; 3 output enable by port; 4 direction by port.
//         T and P models (timers, ports) have other registers and are not supported.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include <mpf/drivers/industry_pack/module.h>

namespace mpf {

struct DigitalIoKind {
  // How a line is driven.
  enum class Driver : std::uint8_t {
    none,  // inputs only
    openCollector,  // 0 pulls the line down; 1 releases it, so that it can be used as an input
    switched,  // each line has an output enable
    separate,  // outputs and inputs are different lines
  };

  std::string_view name;
  std::uint32_t manufacturer = 0;
  std::uint16_t model = 0;
  std::uint32_t inputs = 0;  // bits that can be read
  std::uint32_t outputs = 0;  // bits that can be written
  Driver driver = Driver::openCollector;
  bool hasInterrupts = false;
  bool hasThreshold = false;  // a DAC at word e sets the voltage above which an input is high
  std::uint16_t controlBits = 0;  // bits of the control word that switch the outputs on

  [[nodiscard]] bool isSystran() const noexcept { return manufacturer == kSystran; }
};

namespace digital_io_word {  // word numbers; the byte offset is twice the number
inline constexpr std::size_t kOutput = 0, kInput = 2, kOutputEnable = 4, kControl = 6, kVector = 8;
inline constexpr std::size_t kInterruptEnable = 9, kPolarity = 0xb, kPending = 0xd,
                             kThreshold = 0xe;
inline constexpr std::size_t kSystranEnable = 3, kSystranDirection = 4;
inline constexpr std::uint16_t kSystranPorts = 0xf, kSystranPortsOut = 0x3;
}  // namespace digital_io_word

// The DAC of the comparator has 12 bits; a step is 15 mV.
inline constexpr int kMaxThreshold = 4095;
inline constexpr double kThresholdStepVolts = 0.015;
inline constexpr int kThresholdAtStart = 2500 / 15;

// All supported models.
[[nodiscard]] std::span<const DigitalIoKind> digitalIoKinds() noexcept;
// Returns nullptr when no supported model matches.
[[nodiscard]] const DigitalIoKind* findDigitalIoKind(std::uint32_t manufacturer,
                                                     std::uint16_t model) noexcept;
[[nodiscard]] const DigitalIoKind* findDigitalIoKind(std::string_view name) noexcept;
// The ID PROMs of all supported models, for IndustryPackModules::create().
[[nodiscard]] ModuleKind digitalIoModules();

}  // namespace mpf
