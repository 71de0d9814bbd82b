// SPDX-License-Identifier: MIT
#include "router/config/toml_table.h"

#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <numeric>

namespace mpf::router {
namespace {

const char* kindOf(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return "a list";
    case toml::node_type::string:
      return "a string";
    case toml::node_type::integer:
      return "an integer";
    case toml::node_type::floating_point:
      return "a number with a fraction";
    case toml::node_type::boolean:
      return "true or false";
    default:
      return "a date or a time";
  }
}

// The Levenshtein distance: how many characters are inserted, deleted or replaced to turn a into b.
std::size_t distanceOf(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const auto changed = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = std::exchange(row[j], std::min({changed, row[j] + 1, row[j - 1] + 1}));
    }
  }
  return row.back();
}

}  // namespace

TomlTable::TomlTable(const toml::table& table, std::string file, std::string header)
    : table_(&table), file_(std::move(file)), header_(std::move(header)) {}

std::string TomlTable::placeOf(const toml::source_region& source) const {
  return fmt::format("{}:{}", file_, source.begin.line);
}

Places TomlTable::places() const {
  Places places{{"", placeOf(table_->source())}};
  for (const auto& [key, node] : *table_) places.emplace(key.str(), placeOf(node.source()));
  return places;
}

const toml::node* TomlTable::find(const char* key) {
  known_.emplace_back(key);
  return table_->get(key);
}

template <class Value>
Value TomlTable::take(const char* key, const toml::node& node, const char* wanted) const {
  if (const auto value = node.value_exact<Value>()) return *value;
  throw ConfigError(
      fmt::format("{}: {} is {}; write {}", placeOf(node.source()), key, kindOf(node), wanted));
}

std::int32_t TomlTable::takeInt32(const char* key, const toml::node& node) const {
  const auto value = take<std::int64_t>(key, node, "an integer");
  if (std::in_range<std::int32_t>(value)) return static_cast<std::int32_t>(value);
  throw ConfigError(fmt::format("{}: {} {} is out of range: use -2147483648 to 2147483647",
                                placeOf(node.source()), key, value));
}

void TomlTable::takeEach(const char* key, const std::function<void(const toml::node&)>& use) {
  const auto* const node = find(key);
  if (node == nullptr) return;
  const auto* const list = node->as_array();
  if (list == nullptr) return use(*node);
  if (list->empty())
    throw ConfigError(fmt::format("{}: {} is an empty list; write at least one value",
                                  placeOf(node->source()), key));
  for (const auto& one : *list) use(one);
}

void TomlTable::read(const char* key, std::string& value) {
  if (const auto* const node = find(key))
    value = take<std::string>(key, *node, "a string in quotes");
}

void TomlTable::read(const char* key, std::int32_t& value) {
  if (const auto* const node = find(key)) value = takeInt32(key, *node);
}

void TomlTable::read(const char* key, bool& value) {
  if (const auto* const node = find(key)) value = take<bool>(key, *node, "true or false");
}

void TomlTable::read(const char* key, std::vector<std::int32_t>& values) {
  std::vector<std::int32_t> found;
  takeEach(key, [&](const toml::node& node) { found.push_back(takeInt32(key, node)); });
  if (!found.empty()) values = std::move(found);
}

void TomlTable::read(const char* key, std::vector<std::string>& values) {
  std::vector<std::string> found;
  takeEach(key, [&](const toml::node& node) {
    found.push_back(take<std::string>(key, node, "strings in quotes"));
  });
  if (!found.empty()) values = std::move(found);
}

void TomlTable::readWith(const char* key, const std::function<void(const std::string&)>& use) {
  const auto* const node = find(key);
  if (node == nullptr) return;
  const auto* const integer = node->as_integer();
  const auto text = integer != nullptr ? fmt::format("{}", integer->get())
                                       : take<std::string>(key, *node, "a string in quotes");
  try {
    use(text);
  } catch (const std::invalid_argument& error) {
    throw ConfigError(fmt::format("{}: {}: {}", placeOf(node->source()), key, error.what()));
  }
}

void TomlTable::readTable(const char* key, const std::function<void(TomlTable&)>& use) {
  const auto* const node = find(key);
  if (node == nullptr) return;
  if (!node->is_table())
    throw ConfigError(fmt::format("{}: {} is {}; write [{}], once", placeOf(node->source()), key,
                                  kindOf(*node), key));
  TomlTable table(*node->as_table(), file_, fmt::format("[{}]", key));
  use(table);
}

void TomlTable::readTables(const char* key, const std::function<void(TomlTable&)>& use) {
  const auto* const node = find(key);
  if (node == nullptr) return;
  if (!node->is_array_of_tables()) {
    throw ConfigError(fmt::format("{}: {} is {}; write [[{}]], once for each",
                                  placeOf(node->source()), key, kindOf(*node), key));
  }
  for (const auto& one : *node->as_array()) {
    TomlTable table(*one.as_table(), file_, fmt::format("[[{}]]", key));
    use(table);
  }
}

void TomlTable::finish(const std::vector<std::string>& required) const {
  for (const auto& [key, node] : *table_) {
    if (std::ranges::find(known_, key.str()) == known_.end()) throw unknown(key);
  }
  for (const auto& example : required) {
    const auto key = example.substr(0, example.find(' '));
    if (!table_->contains(key))
      throw ConfigError(fmt::format("{}: {} has no {}; write {}", placeOf(table_->source()),
                                    header_, key, example));
  }
}

ConfigError TomlTable::unknown(const toml::key& key) const {
  const auto nearest = std::ranges::min(
      known_, {}, [&](const std::string& one) { return distanceOf(one, key.str()); });
  const auto isNear = distanceOf(nearest, key.str()) <= key.length() / 2;
  return ConfigError(fmt::format("{}: {}unknown key \"{}\"; {}", placeOf(key.source()),
                                 header_.empty() ? "" : header_ + ": ", key.str(),
                                 isNear ? fmt::format("did you mean \"{}\"?", nearest)
                                        : fmt::format("the keys are {}", fmt::join(known_, ", "))));
}

}  // namespace mpf::router
