// SPDX-License-Identifier: MIT
// DigitalIoKind: what the models of digital I/O modules have in common and what not: GreenSpring IP-Unidig, Systran DIO316I.
//
// Bits are numbered as in the registers: bit 0 is the lowest of the low word, bit 16 the lowest of the high one.
//
// Source  16-bit words from the start of the I/O space: 0, 1 outputs; 2, 3 inputs; 4, 5 output enable; 6 control; 8 interrupt vector;
//         9, A interrupt enable; B, C polarity (1: rising edge); D, E pending, and cleared by writing ones; E the comparator's DAC on -HV.
//         The first driver for EPICS had the low output enable at 8, where the vector is: 4 is right. The DIO316I: 0, 1 outputs, 2 inputs,
//         3 output enable by port, 4 direction by port. T and P models (timers, ports) are other modules.
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
    none,           // inputs only
    openCollector,  // 0 pulls the line down, 1 lets it go: an input
    switched,       // each line has an output enable
    separate,       // outputs and inputs are lines of their own
  };

  std::string_view name;
  std::uint32_t manufacturer = 0;
  std::uint16_t model = 0;
  std::uint32_t inputs = 0;   // bits that can be read
  std::uint32_t outputs = 0;  // bits that can be written
  Driver driver = Driver::openCollector;
  bool hasInterrupts = false;
  bool hasThreshold = false;      // a DAC says from which voltage on an input is high; then word E is this, and no interrupts' business
  std::uint16_t controlBits = 0;  // of the control word, without which there is no output

  [[nodiscard]] bool isSystran() const noexcept { return manufacturer == kSystran; }
};

namespace digital_io_word {  // times two: byte offsets
inline constexpr std::size_t kOutput = 0, kInput = 2, kOutputEnable = 4, kControl = 6, kVector = 8;
inline constexpr std::size_t kInterruptEnable = 9, kPolarity = 0xb, kPending = 0xd, kThreshold = 0xe;
inline constexpr std::size_t kSystranEnable = 3, kSystranDirection = 4;
inline constexpr std::uint16_t kSystranPorts = 0xf, kSystranPortsOut = 0x3;
}  // namespace digital_io_word

// The comparator's DAC: 12 bits of 15 mV.
inline constexpr int kMaxThreshold = 4095;
inline constexpr double kThresholdStepVolts = 0.015;
inline constexpr int kThresholdAtStart = 2500 / 15;

// All of them.
[[nodiscard]] std::span<const DigitalIoKind> digitalIoKinds() noexcept;
// Null: there is none.
[[nodiscard]] const DigitalIoKind* findDigitalIoKind(std::uint32_t manufacturer, std::uint16_t model) noexcept;
[[nodiscard]] const DigitalIoKind* findDigitalIoKind(std::string_view name) noexcept;
// For IndustryPackModules::create(): any of them.
[[nodiscard]] ModuleKind digitalIoModules();

}  // namespace mpf
