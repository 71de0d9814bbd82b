// SPDX-License-Identifier: MIT
#include "base/toml/config_errors.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <string_view>

#include "base/number.h"

namespace mpf {
namespace {

// Takes ":NUMBER" from the end of a text.
std::optional<unsigned> tryTakeLast(std::string_view& text) {
  const auto colon = text.rfind(':');
  if (colon == std::string_view::npos) return std::nullopt;
  const auto number = tryNumber<unsigned>(text.substr(colon + 1));
  text = text.substr(0, colon);
  return number;
}

}  // namespace

void ConfigErrors::add(const std::string& place, const std::string& text) {
  std::string_view rest = place;
  const auto column = tryTakeLast(rest);
  const auto line = tryTakeLast(rest);
  positions_.push_back(line && column ? Position(*line, *column) : Position(~0u, 0));
  lines_.push_back(place.empty() ? text : place + ": " + text);
}

void ConfigErrors::throwIfAny() const {
  if (isEmpty()) return;
  std::vector<std::size_t> order(lines_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return positions_[i]; });
  std::string text;
  for (const auto i : order) text += (text.empty() ? "" : "\n") + lines_[i];
  throw ConfigError(text);
}

}  // namespace mpf
