// SPDX-License-Identifier: MIT
// DigitalIoRegisters: reads and writes pairs of 16-bit registers as one value of 32 bits; accesses
// only the halves that the kind of module has.
//
// Threads  one at a time: the owner holds a lock.
#pragma once

#include <cstdint>

#include <mpf/drivers/industry_pack/registers.h>

#include "drivers/digital_io/digital_io_kind.h"

namespace mpf {

class DigitalIoRegisters {
 public:
  DigitalIoRegisters(Registers& io, const DigitalIoKind& kind) noexcept : io_(io), kind_(kind) {}

  // Accesses the pair that begins at `word`. A half without a bit in `mask` is not accessed, since
  // the module may have another register there.
  [[nodiscard]] std::uint32_t read(std::size_t word, std::uint32_t mask) {
    std::uint32_t bits = 0;
    if (low(mask) != 0) bits = readWord(word);
    if (high(mask) != 0) bits |= std::uint32_t{readWord(word + 1)} << 16;
    return bits;
  }
  void write(std::size_t word, std::uint32_t mask, std::uint32_t bits) {
    if (low(mask) != 0) writeWord(word, low(bits));
    if (high(mask) != 0) writeWord(word + 1, high(bits));
  }
  [[nodiscard]] std::uint16_t readWord(std::size_t word) { return io_.read16(word * 2); }
  void writeWord(std::size_t word, std::uint16_t value) { io_.write16(word * 2, value); }

  // Returns whether each half with a bit in `mask` is all ones, as an absent module reads.
  [[nodiscard]] static bool isAllOnes(std::uint32_t bits, std::uint32_t mask) noexcept {
    return (low(mask) == 0 || low(bits) == 0xffff) && (high(mask) == 0 || high(bits) == 0xffff);
  }

  // Programs the control words and the threshold; after this the outputs can be driven.
  void setUp(int threshold);

 private:
  static std::uint16_t low(std::uint32_t bits) noexcept { return static_cast<std::uint16_t>(bits); }
  static std::uint16_t high(std::uint32_t bits) noexcept {
    return static_cast<std::uint16_t>(bits >> 16);
  }

  Registers& io_;
  const DigitalIoKind& kind_;
};

}  // namespace mpf
