// SPDX-License-Identifier: MIT
#include "epics/devices/string_parm/string_parameters.h"

#include <algorithm>
#include <cctype>
#include <fmt/format.h>
#include <stdexcept>

#include "base/number.h"

namespace mpf {
namespace {

constexpr std::size_t kMaxTerminator = 9;
constexpr std::size_t kServerTerminator = 2;  // serial servers compare the first two bytes

std::optional<std::string_view> valueOf(std::string_view text, std::string_view key) {
  const auto at = text.find(key);
  if (at == std::string_view::npos) return std::nullopt;
  return text.substr(at + key.size());
}

std::string upToComma(std::string_view text) { return std::string(text.substr(0, text.find(','))); }

// As atoi(), which the original used: leading blanks are skipped, no number is 0.
std::int32_t numberOf(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(" \t+"), text.size()));
  return tryTakeNumber<std::int32_t>(text).value_or(0);
}

std::string bytesOf(std::string_view hex) {
  std::string bytes;
  for (; bytes.size() < kMaxTerminator && hex.size() >= 2; hex.remove_prefix(2)) {
    const auto byte = tryNumber<unsigned char>(hex.substr(0, 2), 16);
    if (!byte) break;
    bytes.push_back(static_cast<char>(*byte));
  }
  return bytes;
}

}  // namespace

StringParameters StringParameters::parse(std::string_view text, int index,
                                         std::chrono::milliseconds timeout) {
  StringParameters result;
  result.timeout = timeout;
  if (const auto value = valueOf(text, "TERM=")) result.terminator = bytesOf(*value);
  if (const auto value = valueOf(text, "IX=")) index = numberOf(*value);
  if (const auto value = valueOf(text, "FMT=")) result.format = upToComma(*value);
  if (const auto value = valueOf(text, "TO="))
    result.timeout = std::chrono::milliseconds(std::max(numberOf(*value), 0));
  if (const auto value = valueOf(text, "N=")) result.maxBytes = numberOf(*value);
  if (const auto value = valueOf(text, "0STR=")) result.zero = upToComma(*value);
  if (const auto value = valueOf(text, "1STR=")) result.one = upToComma(*value);
  if (index < 0) throw std::invalid_argument(fmt::format("IX={}: use 0 or a greater index", index));
  result.index = static_cast<std::size_t>(index);
  return result;
}

std::optional<std::string> StringParameters::textOf(std::string_view answer) const {
  if (index >= answer.size()) return std::nullopt;
  if (answer.ends_with(terminator)) {
    answer.remove_suffix(terminator.size());
  } else if (const auto ofServer = terminator.substr(0, kServerTerminator);
             answer.ends_with(ofServer)) {
    answer.remove_suffix(ofServer.size());
  }
  if (index >= answer.size()) return std::string();
  answer.remove_prefix(index);
  return std::string(answer.substr(0, answer.find('\0')));
}

}  // namespace mpf
