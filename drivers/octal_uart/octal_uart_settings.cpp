// SPDX-License-Identifier: MIT
#include "drivers/octal_uart/octal_uart_settings.h"

#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "drivers/octal_uart/scc2698b.h"

namespace mpf {
namespace {

// NOLINTNEXTLINE(google-build-using-namespace): the names of the data sheet
using namespace scc2698b;

constexpr int kMinBitsPerChar = 5;

}  // namespace

std::string octalUartProblemOf(const SerialSettings& settings, bool isRs485) {
  if (auto problem = problemOf(settings); !problem.empty()) return problem;
  if (settings.baud != 0 && std::ranges::find(kBauds, settings.baud) == kBauds.end()) {
    auto bauds = kBauds;
    std::ranges::sort(bauds);
    return fmt::format("baud {}: the chip supports {}", settings.baud, fmt::join(bauds, ", "));
  }
  if (isRs485 && settings.flowControl == 'H')
    return "flow control 'H': an RS-485 port has no RTS/CTS lines; use 'N'";
  return {};
}

OctalUartMode octalUartModeOf(const SerialSettings& settings) {
  const auto code =
      static_cast<unsigned>(std::ranges::find(kBauds, settings.baud) - kBauds.begin());
  unsigned mr1 = static_cast<unsigned>(settings.bitsPerChar - kMinBitsPerChar);
  unsigned mr2 = settings.stopBits == 2 ? kMr2TwoStop : kMr2OneStop;
  if (settings.parity == 'O') mr1 |= kMr1Odd;
  if (settings.parity == 'N') mr1 |= kMr1NoParity;
  if (settings.flowControl == 'H') {
    mr1 |= kMr1RxRts;
    mr2 |= kMr2TxCts;
  }
  return {.mr1 = static_cast<std::uint8_t>(mr1),
          .mr2 = static_cast<std::uint8_t>(mr2),
          .csr = static_cast<std::uint8_t>(code << 4 | code)};
}

SerialSettings settingsOf(const OctalUartMode& mode) {
  const auto code = std::min<std::size_t>(mode.csr & 0xf, kBauds.size() - 1);
  SerialSettings settings;
  settings.baud = kBauds.at(code);
  settings.stopBits = (mode.mr2 & kMr2TwoStop) == kMr2TwoStop ? 2 : 1;
  settings.bitsPerChar = kMinBitsPerChar + (mode.mr1 & kMr1Bits);
  settings.parity = (mode.mr1 & kMr1Odd) != 0 ? 'O' : 'E';
  if ((mode.mr1 & kMr1NoParity) != 0) settings.parity = 'N';
  settings.flowControl = (mode.mr1 & kMr1RxRts) != 0 && (mode.mr2 & kMr2TxCts) != 0 ? 'H' : 'N';
  return settings;
}

std::chrono::nanoseconds byteTime(const SerialSettings& settings) noexcept {
  constexpr std::int64_t kNsPerSecond = 1'000'000'000;
  const auto bits = 1 + settings.bitsPerChar + (settings.parity == 'N' ? 0 : 1) + settings.stopBits;
  return std::chrono::nanoseconds(bits * kNsPerSecond / settings.baud);
}

}  // namespace mpf
