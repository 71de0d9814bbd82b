// SPDX-License-Identifier: MIT
// Parameters of the sites on a Motorola MVME162 or MVME172, which are behind its IPIC chip. For
// each site the string has its letter and then, in any order,
//   l=n[,n]       interrupt levels
//   m=base,sizeK  memory
//   r=us          recovery time
//   w=8|16|32     width; 32 also uses the memory of the next site
// Like drvIpac, the parser skips all other characters. "A:l=3,3 m=0xe0000000,64;B:l=3,3"
#include <fmt/format.h>

#include "drivers/industry_pack/parameter_parsers.h"

namespace mpf::parameters {
namespace {

constexpr std::uint32_t kRegisters = 0xfff58000;
constexpr std::uint32_t kMemoryEnd = 0xfff00000;  // higher addresses are used by the board itself

void readLevels(ParameterText& text, SiteParameters& site) {
  text.expect('=', "l");
  site.interruptLevels = {text.level("interrupt level"), 0};
  if (text.trySkipBeforeNumber(',')) site.interruptLevels[1] = text.level("second interrupt level");
}

void readMemory(ParameterText& text, SiteParameters& site) {
  text.expect('=', "m");
  site.memory =
      text.hex("memory address", {.multipleOf = 0x10000, .least = 0x10000, .most = kMemoryEnd});
  text.expect(',', "memory address");
  site.memoryBytes = text.number("memory size [K]", {.multipleOf = 64, .least = 64, .most = 16384})
                     << 10;
  if (site.memoryBytes > kMemoryEnd - site.memory)
    text.refuse(fmt::format("memory at 0x{:x}, {} K: the end is above 0x{:x}", site.memory,
                            site.memoryBytes >> 10, kMemoryEnd));
}

void readRecovery(ParameterText& text, SiteParameters& site) {
  text.expect('=', "r");
  site.recoveryUs = static_cast<int>(text.number("recovery time [us]", {.most = 8}));
}

void readWidth(ParameterText& text, std::vector<SiteParameters>& sites, std::size_t site) {
  text.expect('=', "w");
  const auto width = text.number("width");
  if (width != 8 && width != 16 && width != 32)
    text.refuse(fmt::format("width {}: use 8, 16 or 32", width));
  if (width == 32 && site % 2 != 0)
    text.refuse(fmt::format(
        "width 32 at site {}: use it only at A and C, which also use the memory of the next site",
        static_cast<char>('A' + site)));
  sites[site].widthBits = static_cast<int>(width);
  if (width == 32) sites[site + 1].memoryBytes = 0;
}

}  // namespace

CarrierParameters parseMvme162(ParameterText& text) {
  CarrierParameters carrier;
  carrier.registers = BusSpace::local;
  carrier.memory = BusSpace::local;
  carrier.sites = makeSites(4, kRegisters);
  std::size_t site = 0;
  while (!text.atEnd()) {
    const char command = text.take();
    if (command >= 'A' && command <= 'D') site = static_cast<std::size_t>(command - 'A');
    if (command == 'R') carrier.isReset = true;
    if (command == 'l') readLevels(text, carrier.sites[site]);
    if (command == 'm') readMemory(text, carrier.sites[site]);
    if (command == 'r') readRecovery(text, carrier.sites[site]);
    if (command == 'w') readWidth(text, carrier.sites, site);
  }
  expectNoOverlap(text, carrier.sites);
  return carrier;
}

}  // namespace mpf::parameters
