// SPDX-License-Identifier: MIT
// IdProm: the identification of a module, which it keeps in its ID space.
//
//   format I   8-bit words 'I' 'P' 'A' 'C' (or 'H': runs at 32 MHz), manufacturer, model, revision,
//              reserved, driver low, driver high, bytes used, CRC-8
//   format II  16-bit words "VI" "TA" "4 ", manufacturer (24 bits), model, revision, reserved,
//              driver low, driver high, flags, bytes used, CRC-16 (0: not checked)
//
// Source  ANSI/VITA 4-1995, chapter "ID PROM".
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <mpf/drivers/industry_pack/registers.h>

namespace mpf {

struct IdProm {
  enum class Format : std::uint8_t { one = 1, two = 2 };

  Format format = Format::one;
  bool runsAt32MHz = false;
  std::uint32_t manufacturer = 0;
  std::uint16_t model = 0;
  std::uint16_t revision = 0;
  std::uint32_t driverId = 0;
  std::uint16_t flags = 0;  // format II only
  std::uint16_t bytesUsed = 12;
  bool hasValidCrc = true;

  friend bool operator==(const IdProm&, const IdProm&) = default;
};

// Reads the ID space, by 16-bit cycles.
//
//   where    the site, for error messages
//   throws   IndustryPackError noModule when nothing answers, noIpacId when the contents are not an
//            ID PROM; a wrong CRC is not an error but IdProm::hasValidCrc
[[nodiscard]] IdProm readIdProm(Registers& idSpace, const std::string& where);

// The 16-bit words of the ID space that readIdProm() reads as `prom`. For device models.
[[nodiscard]] std::vector<std::uint16_t> wordsOf(const IdProm& prom);

// The CRC of a format I PROM with the contents `bytes`; the byte at index 11, the CRC itself,
// counts as 0.
[[nodiscard]] std::uint8_t crcOfFormatOne(std::span<const std::uint8_t> bytes) noexcept;

}  // namespace mpf
