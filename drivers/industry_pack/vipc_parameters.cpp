// SPDX-License-Identifier: MIT
// Parameters of GreenSpring VIPC310, VIPC610, VIPC616: registers in A16, memory in A24 or A32; the
// interrupt levels are fixed.
//   310, 610  base[,memoryK]                            memory in A24, at 256 times the base
//   616       base | base,memoryA32 | base,memoryA24,memoryK
#include <bit>
#include <fmt/format.h>
#include <span>

#include "drivers/industry_pack/parameter_parsers.h"

namespace mpf::parameters {
namespace {

using Levels = std::array<int, 2>;
constexpr std::array<Levels, 2> kLevels310{{{4, 5}, {2, 1}}};
constexpr std::array<Levels, 4> kLevels{{{1, 2}, {3, 4}, {5, 6}, {7, 0}}};
constexpr std::array<Levels, 4> kLevelsDash01{{{4, 5}, {2, 1}, {4, 5}, {2, 1}}};

constexpr std::uint32_t kFactoryBase = 0x6000;
constexpr std::uint32_t kFactoryMemory = 0xd0000000;
constexpr std::uint32_t kMemoryInA32 = 8U << 20;  // bytes of each site

CarrierParameters makeCarrier(std::uint32_t base, std::span<const Levels> levels) {
  CarrierParameters carrier;
  carrier.sites = makeSites(levels.size(), base);
  for (std::size_t i = 0; i < levels.size(); ++i) carrier.sites[i].interruptLevels = levels[i];
  return carrier;
}

std::uint32_t memoryBytes(ParameterText& text) {
  const auto kilobytes = text.number("memory size [K]", {.multipleOf = 64, .most = 2048});
  if (kilobytes != 0 && !std::has_single_bit(kilobytes))
    text.refuse(fmt::format("memory size {} K: use 0, 64, 128, 256, 512, 1024 or 2048", kilobytes));
  return kilobytes << 10;
}

// The carrier decodes one block for all sites and compares only the address bits above the block.
// If `base` is not on a block boundary, the first sites would be below `base`; they get no memory.
void giveMemory(CarrierParameters& carrier, std::uint32_t base, std::uint32_t bytes) {
  if (bytes == 0) return;
  const auto block = base & ~(bytes * static_cast<std::uint32_t>(carrier.sites.size()) - 1);
  for (std::size_t i = 0; i < carrier.sites.size(); ++i) {
    const auto address = block + bytes * static_cast<std::uint32_t>(i);
    if (address < base) continue;
    carrier.sites[i].memory = address;
    carrier.sites[i].memoryBytes = bytes;
  }
}

CarrierParameters parseSmall(ParameterText& text, std::span<const Levels> levels,
                             std::uint32_t mostBase, std::uint32_t registerMask) {
  const auto base = text.atEnd() ? kFactoryBase
                                 : text.hex("I/O address", {.multipleOf = 0x200, .most = mostBase});
  auto carrier = makeCarrier(base & registerMask, levels);
  if (text.trySkip(',')) giveMemory(carrier, base << 8, memoryBytes(text));
  return carrier;
}

CarrierParameters parse616(ParameterText& text, std::span<const Levels> levels) {
  const bool isAsMade = text.atEnd();
  auto carrier = makeCarrier(
      isAsMade ? kFactoryBase : text.hex("I/O address", {.multipleOf = 0x400, .most = 0xfc00}),
      levels);
  if (!isAsMade && !text.trySkip(',')) return carrier;
  const auto memory = isAsMade ? kFactoryMemory : text.hex("memory address");
  if (text.trySkip(',')) {
    if ((memory & 0xff01ffff) != 0)
      text.refuse(fmt::format(
          "memory address 0x{:x}: use a multiple of 0x20000 in A24, at most 0xfe0000", memory));
    giveMemory(carrier, memory, memoryBytes(text));
    return carrier;
  }
  if ((memory & 0x01ffffff) != 0)
    text.refuse(fmt::format(
        "memory address 0x{:x}: use a multiple of 0x2000000 in A32, or add a size [K] for A24",
        memory));
  carrier.memory = BusSpace::vmeA32;
  giveMemory(carrier, memory, kMemoryInA32);
  return carrier;
}

}  // namespace

CarrierParameters parseVipc310(ParameterText& text) {
  return parseSmall(text, kLevels310, 0xfe00, 0xfe00);
}
// Address line 9 selects memory only.
CarrierParameters parseVipc610(ParameterText& text) {
  return parseSmall(text, kLevels, 0xfc00, 0xfc00);
}
CarrierParameters parseVipc610Dash01(ParameterText& text) {
  return parseSmall(text, kLevelsDash01, 0xfc00, 0xfc00);
}
CarrierParameters parseVipc616(ParameterText& text) { return parse616(text, kLevels); }
CarrierParameters parseVipc616Dash01(ParameterText& text) { return parse616(text, kLevelsDash01); }

}  // namespace mpf::parameters
