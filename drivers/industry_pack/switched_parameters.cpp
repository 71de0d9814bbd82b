// SPDX-License-Identifier: MIT
// Parameters of carriers whose addresses and interrupt levels are set with switches or by software:
//   TEWS TVME200        the settings of its six rotary switches, "6010D0"
//   Hytec 8002, 8004    slot,level [IPMEM=1|2|4|8] [MEMBASE=high half of the address] [IPCLK=8|32]
//                       [ROAK=0|1]
//   Acromag AVME-96xx   base,level [R] [A=megabytes,address] ...
//   SBS ATC40 (ISA)     address [16384 [irq]]
#include <algorithm>
#include <cctype>
#include <fmt/format.h>

#include "drivers/industry_pack/parameter_parsers.h"

namespace mpf::parameters {
namespace {

// TVME200: the interrupt levels of the sites for each setting of switch S3.
constexpr std::array<std::array<std::array<int, 2>, 4>, 5> kSwitchedLevels{{
    {{{0, 0}, {0, 0}, {0, 0}, {0, 0}}},
    {{{1, 2}, {3, 4}, {5, 6}, {7, 0}}},
    {{{4, 5}, {2, 1}, {4, 5}, {2, 1}}},
    {{{6, 4}, {3, 1}, {6, 4}, {3, 1}}},
    {{{1, 1}, {2, 2}, {3, 3}, {4, 4}}},
}};

constexpr std::uint32_t kMegabyte = 1U << 20;

void giveLevel(std::vector<SiteParameters>& sites, int level) {
  for (auto& site : sites) site.interruptLevels = {level, level};
}

void giveMemory(std::vector<SiteParameters>& sites, std::uint32_t base, std::uint32_t bytes) {
  for (auto& site : sites) {
    site.memory = base;
    site.memoryBytes = bytes;
    base += bytes;
  }
}

bool isSize(std::uint32_t megabytes) noexcept {
  return megabytes == 1 || megabytes == 2 || megabytes == 4 || megabytes == 8;
}

std::uint32_t readMegabytes(ParameterText& text, std::string_view what) {
  const auto megabytes = text.number(what);
  if (!isSize(megabytes)) text.refuse(fmt::format("{} {}: use 1, 2, 4 or 8", what, megabytes));
  return megabytes;
}

// Switches S4 to S6 of a TVME200: size and address of the memory.
void readSwitchedMemory(const ParameterText& text, CarrierParameters& carrier, std::uint32_t size,
                        std::uint32_t high) {
  if (size == 0) return;
  if (size > 7 && size != 0xf) text.refuse(fmt::format("switch S4 at {:X}: use 0 to 7 or F", size));
  const bool isA32 = size == 0xf;
  const auto base = isA32 ? high << 24 : high << 16;
  const auto bytes = isA32 ? 8 * kMegabyte : 16384U << size;
  if (base % (4 * bytes) != 0)
    text.refuse(
        fmt::format("switches S5 and S6 at {:02X}: 0x{:x} is not a multiple of 0x{:x}, the memory "
                    "of four sites",
                    high, base, 4 * bytes));
  carrier.memory = isA32 ? BusSpace::vmeA32 : BusSpace::vmeA24;
  giveMemory(carrier.sites, base, bytes);
}

struct HytecMemory {
  std::uint32_t megabytes = 1;
  std::optional<std::uint32_t> high;  // bits 31 to 16 of the address
};

void readHytecOption(ParameterText& text, CarrierParameters& carrier, HytecMemory& memory) {
  const auto at = text.rest();
  const auto name = text.word();
  if (name != "IPMEM" && name != "MEMBASE" && name != "IPCLK" && name != "IPCLCK" && name != "ROAK")
    text.refuse(fmt::format("\"{}\": use IPMEM, MEMBASE, IPCLK or ROAK", at));
  text.expect('=', name);
  if (name == "IPMEM") {
    memory.megabytes = readMegabytes(text, name);
  } else if (name == "MEMBASE") {
    memory.high = text.number(name, {.most = 0xffff});
  } else if (name == "ROAK") {
    carrier.releasesOnAcknowledge = text.number(name, {.most = 1}) == 1;
  } else {
    const auto clock = text.number(name);
    if (clock != 8 && clock != 32) text.refuse(fmt::format("{} {}: use 8 or 32", name, clock));
    carrier.clockMHz = static_cast<int>(clock);
  }
}

// Without a MEMBASE the slot determines the address.
std::uint32_t hytecMemoryBase(const ParameterText& text, std::uint32_t slot,
                              const HytecMemory& memory) {
  if (memory.high) {
    const auto base = *memory.high << 16;
    const auto all = 4 * memory.megabytes * kMegabyte;
    if (base % all != 0)
      text.refuse(fmt::format("MEMBASE 0x{:x} with IPMEM {}: use a multiple of 0x{:x}",
                              *memory.high, memory.megabytes, all >> 16));
    return base;  // such memory ends within A32, or exactly with it
  }
  if (memory.megabytes == 4) text.refuse("IPMEM 4 needs a MEMBASE");
  if (memory.megabytes == 2 && slot > 15)
    text.refuse(fmt::format("IPMEM 2 in slot {} needs a MEMBASE", slot));
  return memory.megabytes == 8 ? slot << 27 : slot * 4 * memory.megabytes * kMegabyte;
}

void readAvmeMemory(ParameterText& text, std::vector<SiteParameters>& sites) {
  const auto at = std::string(text.rest());
  const int letter = std::toupper(static_cast<unsigned char>(text.peek()));
  if (letter < 'A' || letter > 'D')
    text.refuse(fmt::format("\"{}\": use the sites A, B, C or D, and R before them", at));
  static_cast<void>(text.take());
  auto& site = sites[static_cast<std::size_t>(letter - 'A')];
  text.expect('=', "site");
  site.memoryBytes = readMegabytes(text, "memory size [M]") * kMegabyte;
  text.expect(',', "memory size");
  site.memory = text.hex("memory address",
                         {.multipleOf = site.memoryBytes, .most = 0x1000000 - site.memoryBytes});
}

}  // namespace

std::vector<SiteParameters> makeSites(std::size_t count, std::uint32_t base) {
  std::vector<SiteParameters> sites(count);
  for (auto& site : sites) {
    site.io = base;
    site.id = base + 0x80;
    base += 0x100;
  }
  return sites;
}

void expectNoOverlap(const ParameterText& text, const std::vector<SiteParameters>& sites) {
  for (std::size_t i = 0; i < sites.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const auto& a = sites[i];
      const auto& b = sites[j];
      if (a.memoryBytes == 0 || b.memoryBytes == 0) continue;
      if (a.memory < std::uint64_t{b.memory} + b.memoryBytes &&
          b.memory < std::uint64_t{a.memory} + a.memoryBytes)
        text.refuse(fmt::format("the memory of site {} overlaps with that of site {}",
                                static_cast<char>('A' + i), static_cast<char>('A' + j)));
    }
  }
}

CarrierParameters parseTvme200(ParameterText& text) {
  static_cast<void>(text.peek());
  const auto digits = text.rest();
  const auto isHex = [](unsigned char digit) { return std::isxdigit(digit) != 0; };
  if (digits.size() != 6 || !std::ranges::all_of(digits, isHex))
    text.refuse("use six hexadecimal digits, one for each of the switches S1 to S6");
  const auto switches = text.hex("switches");
  const auto base = (switches >> 8) & 0xf000;
  const auto second = (switches >> 16) & 0xf;
  const auto levels = (switches >> 12) & 0xf;
  if (second % 4 != 0) text.refuse(fmt::format("switch S2 at {:X}: use 0, 4, 8 or C", second));
  if (levels >= kSwitchedLevels.size())
    text.refuse(fmt::format("switch S3 at {:X}: use 0 to 4", levels),
                IndustryPackStatus::badIntLevel);
  CarrierParameters carrier;
  carrier.sites = makeSites(4, base | second << 8);
  for (std::size_t i = 0; i < carrier.sites.size(); ++i)
    carrier.sites[i].interruptLevels = kSwitchedLevels[levels][i];
  readSwitchedMemory(text, carrier, (switches >> 8) & 0xf, switches & 0xff);
  return carrier;
}

CarrierParameters parseHytec(ParameterText& text) {
  const auto slot = text.number("slot", {.most = 21});
  text.expect(',', "slot");
  CarrierParameters carrier;
  carrier.memory = BusSpace::vmeA32;
  carrier.sites = makeSites(4, slot << 11);
  giveLevel(carrier.sites, text.level("interrupt level"));
  HytecMemory memory;
  for (text.trySkip(','); !text.atEnd(); text.trySkip(',')) readHytecOption(text, carrier, memory);
  giveMemory(carrier.sites, hytecMemoryBase(text, slot, memory), memory.megabytes * kMegabyte);
  return carrier;
}

CarrierParameters parseAvme96xx(ParameterText& text) {
  CarrierParameters carrier;
  carrier.sites = makeSites(4, text.hex("I/O address", {.multipleOf = 0x400, .most = 0xfc00}));
  text.expect(',', "I/O address");
  giveLevel(carrier.sites, text.level("interrupt level"));
  carrier.isReset = text.trySkip('R') || text.trySkip('r');
  while (!text.atEnd()) readAvmeMemory(text, carrier.sites);
  expectNoOverlap(text, carrier.sites);
  return carrier;
}

CarrierParameters parseAtc40(ParameterText& text) {
  constexpr std::uint32_t kWindow = 0x4000;  // bytes
  constexpr std::uint32_t kMostIrq = 15;
  const auto base = text.atEnd()
                        ? 0xa0000
                        : text.hex("address", {.multipleOf = 0x100, .most = 0x1000000 - kWindow});
  if (text.peek() == ',') text.refuse("separate the parameters with blanks, not commas");
  if (!text.atEnd())
    static_cast<void>(text.number("size [bytes]", {.least = kWindow, .most = kWindow}));
  const auto irq = text.atEnd() ? 11 : text.number("interrupt request");
  if (irq > kMostIrq)
    text.refuse(fmt::format("interrupt request {}: use 0 to {}", irq, kMostIrq),
                IndustryPackStatus::badIntLevel);
  CarrierParameters carrier;
  carrier.registers = BusSpace::isa;
  carrier.memory = BusSpace::isa;
  carrier.sites = makeSites(4, base);
  giveLevel(carrier.sites, static_cast<int>(irq));
  giveMemory(carrier.sites, base + 0x800, 0x800);
  return carrier;
}

}  // namespace mpf::parameters
