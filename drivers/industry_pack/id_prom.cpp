// SPDX-License-Identifier: MIT
#include <mpf/drivers/industry_pack/id_prom.h>

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <optional>

#include <mpf/drivers/industry_pack/industry_pack_error.h>

namespace mpf {
namespace {

constexpr std::size_t kCrcOfOne = 11;  // index in words
constexpr std::size_t kCrcOfTwo = 12;
constexpr std::uint16_t kNothing = 0xffff;

// CRC-CCITT, most significant bit first.
std::uint16_t crc16(std::span<const std::uint8_t> bytes) noexcept {
  std::uint16_t crc = 0xffff;
  for (const auto byte : bytes) {
    for (int bit = 7; bit >= 0; --bit) {
      const auto carry = ((crc >> 15) ^ (byte >> bit)) & 1;
      crc = static_cast<std::uint16_t>(crc << 1);
      if (carry != 0) crc ^= 0x1021;
    }
  }
  return static_cast<std::uint16_t>(~crc);
}

// The CRC of a format II PROM; the word of the CRC itself counts as 0.
std::uint16_t crcOfFormatTwo(std::span<const std::uint16_t> words) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const auto word = i == kCrcOfTwo ? std::uint16_t{0} : words[i];
    bytes.push_back(static_cast<std::uint8_t>(word >> 8));
    bytes.push_back(static_cast<std::uint8_t>(word));
  }
  return crc16(bytes);
}

class Reader {
 public:
  explicit Reader(Registers& space) : space_(space) {}
  std::uint16_t word(std::size_t i) {
    return 2 * i + 2 <= space_.size() ? space_.read16(2 * i) : kNothing;
  }
  std::uint8_t byte(std::size_t i) { return static_cast<std::uint8_t>(word(i)); }
  std::size_t words() const { return space_.size() / 2; }

 private:
  Registers& space_;
};

bool hasValidCrcOfFormatOne(Reader& reader, std::size_t bytesUsed) {
  if (bytesUsed <= kCrcOfOne || bytesUsed > reader.words()) return false;
  std::vector<std::uint8_t> bytes;
  bytes.reserve(bytesUsed);
  for (std::size_t i = 0; i < bytesUsed; ++i) bytes.push_back(reader.byte(i));
  return crcOfFormatOne(bytes) == bytes[kCrcOfOne];
}

bool hasValidCrcOfFormatTwo(Reader& reader, std::size_t bytesUsed) {
  const auto crc = reader.word(kCrcOfTwo);
  if (crc == 0) return true;
  if (bytesUsed / 2 <= kCrcOfTwo || bytesUsed / 2 > reader.words()) return false;
  std::vector<std::uint16_t> words;
  words.reserve(bytesUsed / 2);
  for (std::size_t i = 0; i < bytesUsed / 2; ++i) words.push_back(reader.word(i));
  return crcOfFormatTwo(words) == crc;
}

std::optional<IdProm> tryFormatOne(Reader& reader) {
  if (reader.byte(0) != 'I' || reader.byte(1) != 'P' || reader.byte(2) != 'A') return {};
  const auto last = reader.byte(3);
  if (last != 'C' && last != 'H') return {};
  IdProm prom;
  prom.runsAt32MHz = last == 'H';
  prom.manufacturer = reader.byte(4);
  prom.model = reader.byte(5);
  prom.revision = reader.byte(6);
  prom.driverId = reader.byte(8) | static_cast<std::uint32_t>(reader.byte(9)) << 8;
  prom.bytesUsed = reader.byte(10);
  prom.hasValidCrc = hasValidCrcOfFormatOne(reader, prom.bytesUsed);
  return prom;
}

constexpr std::array<std::uint16_t, 3> kVita4{0x5649, 0x5441, 0x3420};  // "VITA4 "

std::optional<IdProm> tryFormatTwo(Reader& reader) {
  for (std::size_t i = 0; i < kVita4.size(); ++i) {
    if (reader.word(i) != kVita4[i]) return {};
  }
  IdProm prom{.format = IdProm::Format::two};
  prom.manufacturer = static_cast<std::uint32_t>(reader.word(3)) << 16 | reader.word(4);
  prom.model = reader.word(5);
  prom.revision = reader.word(6);
  prom.driverId = reader.word(8) | static_cast<std::uint32_t>(reader.word(9)) << 16;
  prom.flags = reader.word(10);
  prom.runsAt32MHz = (prom.flags & 4) != 0;
  prom.bytesUsed = reader.word(11);
  prom.hasValidCrc = hasValidCrcOfFormatTwo(reader, prom.bytesUsed);
  return prom;
}

std::vector<std::uint16_t> wordsOfFormatOne(const IdProm& prom) {
  std::vector<std::uint8_t> bytes{'I',
                                  'P',
                                  'A',
                                  static_cast<std::uint8_t>(prom.runsAt32MHz ? 'H' : 'C'),
                                  static_cast<std::uint8_t>(prom.manufacturer),
                                  static_cast<std::uint8_t>(prom.model),
                                  static_cast<std::uint8_t>(prom.revision),
                                  0,
                                  static_cast<std::uint8_t>(prom.driverId),
                                  static_cast<std::uint8_t>(prom.driverId >> 8),
                                  static_cast<std::uint8_t>(prom.bytesUsed),
                                  0};
  bytes.resize(std::max<std::size_t>(bytes.size(), prom.bytesUsed));
  bytes[kCrcOfOne] = crcOfFormatOne(bytes);
  if (!prom.hasValidCrc) ++bytes[kCrcOfOne];
  return {bytes.begin(), bytes.end()};
}

std::vector<std::uint16_t> wordsOfFormatTwo(const IdProm& prom) {
  std::vector<std::uint16_t> words{kVita4[0],
                                   kVita4[1],
                                   kVita4[2],
                                   static_cast<std::uint16_t>(prom.manufacturer >> 16),
                                   static_cast<std::uint16_t>(prom.manufacturer),
                                   prom.model,
                                   prom.revision,
                                   0,
                                   static_cast<std::uint16_t>(prom.driverId),
                                   static_cast<std::uint16_t>(prom.driverId >> 16),
                                   prom.flags,
                                   prom.bytesUsed,
                                   0};
  words.resize(std::max<std::size_t>(words.size(), prom.bytesUsed / 2));
  words[kCrcOfTwo] = crcOfFormatTwo(words);
  if (!prom.hasValidCrc) ++words[kCrcOfTwo];
  return words;
}

}  // namespace

std::uint8_t crcOfFormatOne(std::span<const std::uint8_t> bytes) noexcept {
  std::array<std::uint8_t, 256> counted{};
  const auto n = std::min(bytes.size(), counted.size());
  std::copy_n(bytes.begin(), n, counted.begin());
  counted[kCrcOfOne] = 0;
  return static_cast<std::uint8_t>(crc16(std::span(counted).first(n)));
}

IdProm readIdProm(Registers& idSpace, const std::string& where) {
  Reader reader(idSpace);
  if (const auto prom = tryFormatOne(reader)) return *prom;
  if (const auto prom = tryFormatTwo(reader)) return *prom;
  if (reader.word(0) == kNothing && reader.word(1) == kNothing) {
    throw IndustryPackError(IndustryPackStatus::noModule, fmt::format("no module at {}", where));
  }
  throw IndustryPackError(
      IndustryPackStatus::noIpacId,
      fmt::format("the module at {} has no valid ID PROM: it begins with {:04x} {:04x}", where,
                  reader.word(0), reader.word(1)));
}

std::vector<std::uint16_t> wordsOf(const IdProm& prom) {
  return prom.format == IdProm::Format::one ? wordsOfFormatOne(prom) : wordsOfFormatTwo(prom);
}

}  // namespace mpf
