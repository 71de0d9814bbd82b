// SPDX-License-Identifier: MIT
// prologix: texts that a Prologix controller understands and sends.
//
//   ++addr 22 101\n        a command: two plus signs that are not escaped
//   DATA <ESC><LF> 1\n     anything else is data; ESC stands before each ESC, CR, LF and plus sign
//
// Threads  any.
// Source   Prologix GPIB-USB user manual, "Binary Data Transmission" and "Commands".
#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include <mpf/drivers/gpib/gpib_types.h>

namespace mpf::prologix {

inline constexpr char kEscape = '\x1b';
// How each version of the hardware begins its answer to ++ver.
inline constexpr std::string_view kName = "Prologix GPIB";
// What secondary address 0 is in commands.
inline constexpr int kFirstSecondary = 96;
// The range of ++read_tmo_ms.
inline constexpr std::chrono::milliseconds kShortestSilence{1};
inline constexpr std::chrono::milliseconds kLongestSilence{3000};
// The number of instruments that one ++trg accepts.
inline constexpr std::size_t kMostTriggered = 15;

// Whether `byte` needs an escape before it.
[[nodiscard]] constexpr bool isSpecial(char byte) noexcept {
  return byte == '\r' || byte == '\n' || byte == kEscape || byte == '+';
}
// "22", or "22 101" with secondary address 5.
[[nodiscard]] std::string addressText(const GpibAddress& address);
// Appends the lines that send `data` to the current instrument, END with the last byte if `end`.
// A line is shorter than the buffer of every controller that is known (127 bytes).
void appendData(std::string& lines, std::span<const std::uint8_t> data, bool end);

}  // namespace mpf::prologix
