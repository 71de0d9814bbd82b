// SPDX-License-Identifier: MIT
#include "drivers/gpib/prologix_commands.h"

#include <fmt/format.h>
#include <utility>

namespace mpf::prologix {
namespace {

constexpr std::size_t kMostBytesOfLine = 120;  // with escapes, without the end of the line

}  // namespace

std::string addressText(const GpibAddress& address) {
  if (!address.secondary) return fmt::format("{}", address.primary);
  return fmt::format("{} {}", address.primary, kFirstSecondary + *address.secondary);
}

void appendData(std::string& lines, std::span<const std::uint8_t> data, bool end) {
  std::string line;
  bool isFirst = true;
  for (const auto value : data) {
    if (line.size() + 2 > kMostBytesOfLine) {
      if (std::exchange(isFirst, false)) lines += "++eoi 0\n";
      lines.append(line).append("\n");
      line.clear();
    }
    const auto byte = static_cast<char>(value);
    if (isSpecial(byte)) line += kEscape;
    line += byte;
  }
  lines.append(end ? "++eoi 1\n" : "++eoi 0\n").append(line).append("\n");
}

}  // namespace mpf::prologix
