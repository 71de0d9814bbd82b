// SPDX-License-Identifier: MIT
#include "epics/general/link_options.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "base/number.h"

namespace mpf {
namespace {

using Mode = LinkOptions::Mode;

constexpr double kMaxTimeoutS = 1e6;

[[noreturn]] void refuse(std::string_view key, std::string_view value, std::string_view valid) {
  throw std::invalid_argument(fmt::format("{}={}: use {}", key, value, valid));
}

// Decimal, or hexadecimal after 0x: from `low` to `high`.
std::int64_t integerOf(std::string_view key, std::string_view text, std::int64_t low,
                       std::int64_t high) {
  std::optional<std::int64_t> number;
  if (text.starts_with("0x") || text.starts_with("0X")) {
    if (const auto bits = tryNumber<std::uint32_t>(text.substr(2), 16))
      number = low < 0 ? std::int64_t{static_cast<std::int32_t>(*bits)} : std::int64_t{*bits};
  } else {
    number = tryNumber<std::int64_t>(text);
  }
  if (!number || *number < low || *number > high)
    refuse(key, text, fmt::format("an integer from {} to {}", low, high));
  return *number;
}

std::int32_t int32Of(std::string_view key, std::string_view text) {
  return static_cast<std::int32_t>(integerOf(key, text, INT32_MIN, INT32_MAX));
}

double doubleOf(std::string_view key, std::string_view text) {
  const auto number = tryNumber<double>(text);
  if (!number || !std::isfinite(*number)) refuse(key, text, "a number");
  return *number;
}

template <class Choice, std::size_t n>
Choice choiceOf(std::string_view key, std::string_view text,
                const std::array<std::pair<std::string_view, Choice>, n>& choices) {
  for (const auto& [name, choice] : choices)
    if (name == text) return choice;
  std::vector<std::string_view> names;
  for (const auto& [name, choice] : choices) names.push_back(name);
  refuse(key, text, fmt::format("{}", fmt::join(names, ", ")));
}

constexpr std::array<std::pair<std::string_view, MessageType>, 5> kTypes{
    {{"int32", MessageType::int32},
     {"float64", MessageType::float64},
     {"int32Array", MessageType::int32Array},
     {"float64Array", MessageType::float64Array},
     {"char8Array", MessageType::char8Array}}};
constexpr std::array<std::pair<std::string_view, Mode>, 2> kInputModes{
    {{"read", Mode::read}, {"subscribe", Mode::subscribe}}};
constexpr std::array<std::pair<std::string_view, Mode>, 1> kOutputModes{{{"write", Mode::write}}};
constexpr std::array<std::pair<std::string_view, bool>, 2> kYesNo{{{"yes", true}, {"no", false}}};

double timeoutOf(std::string_view key, std::string_view text) {
  const auto seconds = tryNumber<double>(text);
  if (!seconds || !(*seconds >= 0 && *seconds <= kMaxTimeoutS))
    refuse(key, text, fmt::format("seconds from 0 (no limit) to {}", kMaxTimeoutS));
  return *seconds;
}

LinkOptions::Range rangeOf(std::string_view key, std::string_view text) {
  const auto colon = text.find(':');
  const auto low = tryNumber<double>(text.substr(0, colon));
  const auto high =
      colon == std::string_view::npos ? std::nullopt : tryNumber<double>(text.substr(colon + 1));
  if (!low || !high || !std::isfinite(*high - *low) || *low == *high)
    refuse(key, text, "<low>:<high>, two different numbers");
  return {*low, *high};
}

using Set = void (*)(LinkOptions&, std::string_view key, std::string_view value);
struct Key {
  std::string_view name;
  bool forInputs;
  bool forOutputs;
  Set set;
};
using View = std::string_view;
constexpr std::array kKeys{
    Key{"type", true, true,
        [](LinkOptions& o, View key, View v) { o.type = choiceOf(key, v, kTypes); }},
    Key{"cmd", true, true, [](LinkOptions& o, View key, View v) { o.cmd = int32Of(key, v); }},
    Key{"address", true, true,
        [](LinkOptions& o, View key, View v) { o.address = int32Of(key, v); }},
    Key{"extra", true, true, [](LinkOptions& o, View key, View v) { o.extra = int32Of(key, v); }},
    Key{"value", true, false, [](LinkOptions& o, View key, View v) { o.value = doubleOf(key, v); }},
    Key{"timeout", true, true,
        [](LinkOptions& o, View key, View v) { o.timeout = timeoutOf(key, v); }},
    Key{"mode", true, true,
        [](LinkOptions& o, View key, View v) {
          o.mode = o.mode == Mode::write ? choiceOf(key, v, kOutputModes)
                                         : choiceOf(key, v, kInputModes);
        }},
    Key{"mask", true, true,
        [](LinkOptions& o, View key, View v) {
          o.mask = static_cast<std::uint32_t>(integerOf(key, v, 1, UINT32_MAX));
        }},
    Key{"shift", true, true,
        [](LinkOptions& o, View key, View v) {
          o.shift = static_cast<int>(integerOf(key, v, 0, 31));
        }},
    Key{"range", true, true, [](LinkOptions& o, View key, View v) { o.range = rangeOf(key, v); }},
    Key{"readback", false, true,
        [](LinkOptions& o, View key, View v) { o.readback = int32Of(key, v); }},
    Key{"rewrite", false, true,
        [](LinkOptions& o, View key, View v) { o.rewrite = choiceOf(key, v, kYesNo); }},
};

const Key& keyNamed(std::string_view name, bool isOutput) {
  const auto isValid = [&](const Key& key) { return isOutput ? key.forOutputs : key.forInputs; };
  const auto found = std::ranges::find(kKeys, name, &Key::name);
  if (found != kKeys.end() && isValid(*found)) return *found;
  std::vector<std::string_view> names;
  for (const auto& key : kKeys)
    if (isValid(key)) names.push_back(key.name);
  throw std::invalid_argument(fmt::format("invalid key \"{}\": the keys of an {} record are {}",
                                          name, isOutput ? "output" : "input",
                                          fmt::join(names, ", ")));
}

// Whether a record can use mask= and shift=: not with floating-point numbers, which have no bits.
// Text may be an integer, but ai and ao take it as a floating-point number.
bool canSelectBits(MessageType type, const LinkOptions::Defaults& defaults) {
  if (!defaults.canHaveBits) return false;
  return type == MessageType::int32 || type == MessageType::int32Array ||
         (type == MessageType::char8Array && defaults.type == MessageType::int32);
}

}  // namespace

LinkOptions LinkOptions::parse(std::string_view text, const Defaults& defaults) {
  constexpr std::string_view kSeparators = " ,\t";
  LinkOptions options{.type = defaults.type, .mode = defaults.mode};
  std::vector<const Key*> seen;
  for (auto begin = text.find_first_not_of(kSeparators); begin != std::string_view::npos;
       begin = text.find_first_not_of(kSeparators)) {
    text.remove_prefix(begin);
    const auto pair = text.substr(0, text.find_first_of(kSeparators));
    text.remove_prefix(pair.size());
    const auto equals = pair.find('=');
    if (equals == std::string_view::npos)
      throw std::invalid_argument(fmt::format("\"{}\": use <key>=<value>", pair));
    const auto& key = keyNamed(pair.substr(0, equals), defaults.mode == Mode::write);
    if (std::ranges::find(seen, &key) != seen.end())
      throw std::invalid_argument(fmt::format("{} appears twice; write it once", key.name));
    seen.push_back(&key);
    key.set(options, key.name, pair.substr(equals + 1));
  }
  if (options.selectsBits() && !canSelectBits(options.type, defaults))
    throw std::invalid_argument(
        "mask=, shift=: use them with type=int32, in a record of a number or of bits");
  if (options.range && !defaults.canHaveRange)
    throw std::invalid_argument("range=: use it in an ai or ao record");
  return options;
}

std::int32_t LinkOptions::timeoutField() const noexcept {
  return static_cast<std::int32_t>(std::ceil(timeout.value_or(0)));
}

}  // namespace mpf
