// SPDX-License-Identifier: MIT
#include "base/toml/toml_table.h"

#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <numeric>
#include <system_error>

#include "base/whole_file.h"

namespace mpf {
namespace {

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

toml::table parseTomlFile(const std::string& file) try {
  return toml::parse(readWholeFile(file), file);
} catch (const toml::parse_error& error) {
  throw ConfigError(fmt::format("{}:{}:{}: {}", file, error.source().begin.line,
                                error.source().begin.column, error.description()));
} catch (const std::system_error& error) {
  throw ConfigError(fmt::format("{}: cannot be read: {}", file, error.code().message()));
}

std::string suggestion(std::string_view written, const std::vector<std::string>& possible,
                       std::string_view plural) {
  const auto distance = [&](const std::string& one) { return distanceOf(one, written); };
  if (!possible.empty()) {
    const auto nearest = std::ranges::min(possible, {}, distance);
    if (distance(nearest) <= written.size() / 2)
      return fmt::format("did you mean \"{}\"?", nearest);
  }
  return fmt::format("the {} are {}", plural, fmt::join(possible, ", "));
}

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

TomlTable::TomlTable(const toml::table& table, std::string file, std::string header,
                     ConfigErrors& errors)
    : table_(&table), file_(std::move(file)), header_(std::move(header)), errors_(&errors) {}

std::string TomlTable::placeOf(const toml::source_region& source) const {
  return fmt::format("{}:{}:{}", file_, source.begin.line, source.begin.column);
}

std::string TomlTable::placeOf(const toml::node& node) const { return placeOf(node.source()); }

void TomlTable::refuse(const toml::node& node, const std::string& text) const {
  errors_->add(placeOf(node), text);
}

Places TomlTable::places() const {
  Places places{{"", placeOf(table_->source())}};
  for (const auto& [key, node] : *table_) places.emplace(key.str(), placeOf(node));
  return places;
}

const toml::node* TomlTable::find(const char* key) {
  known_.emplace_back(key);
  return table_->get(key);
}

template <class Value>
std::optional<Value> TomlTable::take(const char* key, const toml::node& node,
                                     const char* wanted) const {
  if (auto value = node.value_exact<Value>()) return value;
  refuse(node, fmt::format("{} is {}; write {}", key, kindOf(node), wanted));
  return std::nullopt;
}

std::optional<std::int32_t> TomlTable::takeInt32(const char* key, const toml::node& node) const {
  const auto value = take<std::int64_t>(key, node, "an integer");
  if (!value) return std::nullopt;
  if (std::in_range<std::int32_t>(*value)) return static_cast<std::int32_t>(*value);
  refuse(node, fmt::format("{} {} is out of range: use -2147483648 to 2147483647", key, *value));
  return std::nullopt;
}

void TomlTable::takeEach(const char* key, const std::function<void(const toml::node&)>& use) {
  const auto* const node = find(key);
  if (node == nullptr) return;
  const auto* const list = node->as_array();
  if (list == nullptr) return use(*node);
  if (list->empty())
    refuse(*node, fmt::format("{} is an empty list; write at least one value", key));
  for (const auto& one : *list) use(one);
}

void TomlTable::read(const char* key, std::string& value) {
  if (const auto* const node = find(key))
    value = take<std::string>(key, *node, "a string in quotes").value_or(value);
}

void TomlTable::read(const char* key, std::int32_t& value) {
  if (const auto* const node = find(key)) value = takeInt32(key, *node).value_or(value);
}

void TomlTable::read(const char* key, bool& value) {
  if (const auto* const node = find(key))
    value = take<bool>(key, *node, "true or false").value_or(value);
}

void TomlTable::read(const char* key, std::vector<std::int32_t>& values) {
  std::vector<std::int32_t> found;
  takeEach(key, [&](const toml::node& node) {
    if (const auto value = takeInt32(key, node)) found.push_back(*value);
  });
  if (!found.empty()) values = std::move(found);
}

void TomlTable::read(const char* key, std::vector<std::string>& values) {
  std::vector<std::string> found;
  takeEach(key, [&](const toml::node& node) {
    if (auto value = take<std::string>(key, node, "strings in quotes"))
      found.push_back(std::move(*value));
  });
  if (!found.empty()) values = std::move(found);
}

void TomlTable::readWith(const char* key, const std::function<void(const std::string&)>& use) {
  const auto* const node = find(key);
  if (node == nullptr) return;
  const auto* const integer = node->as_integer();
  const auto text = integer != nullptr ? std::optional(fmt::format("{}", integer->get()))
                                       : take<std::string>(key, *node, "a string in quotes");
  if (!text) return;
  try {
    use(*text);
  } catch (const std::invalid_argument& error) {
    refuse(*node, fmt::format("{}: {}", key, error.what()));
  }
}

void TomlTable::readTable(const char* key, const std::function<void(TomlTable&)>& use) {
  const auto* const node = find(key);
  if (node == nullptr) return;
  if (!node->is_table())
    return refuse(*node, fmt::format("{} is {}; write [{}], once", key, kindOf(*node), key));
  TomlTable table(*node->as_table(), file_, fmt::format("[{}]", key), *errors_);
  use(table);
}

void TomlTable::readTables(const char* key, const std::function<void(TomlTable&)>& use) {
  const auto* const node = find(key);
  if (node == nullptr) return;
  if (!node->is_array_of_tables()) {
    return refuse(*node,
                  fmt::format("{} is {}; write [[{}]], once for each", key, kindOf(*node), key));
  }
  for (const auto& one : *node->as_array()) {
    TomlTable table(*one.as_table(), file_, fmt::format("[[{}]]", key), *errors_);
    use(table);
  }
}

void TomlTable::readNamed(const char* key,
                          const std::function<void(const std::string&, const toml::node&)>& use) {
  const auto* const node = find(key);
  if (node == nullptr) return;
  if (!node->is_table())
    return refuse(*node, fmt::format("{} is {}; write [{}]", key, kindOf(*node), key));
  for (const auto& [name, value] : *node->as_table()) use(std::string(name.str()), value);
}

void TomlTable::finish(const std::vector<std::string>& required,
                       const std::function<std::string(const std::string& key)>& placeOfKey) const {
  const auto prefix = header_.empty() ? "" : header_ + ": ";
  for (const auto& [tomlKey, node] : *table_) {
    const std::string key(tomlKey.str());
    if (std::ranges::find(known_, key) != known_.end()) continue;
    const auto isNear = [&](const std::string& known) { return distanceOf(known, key) <= 1; };
    const auto place = placeOfKey && std::ranges::none_of(known_, isNear) ? placeOfKey(key) : "";
    errors_->add(placeOf(tomlKey.source()),
                 fmt::format("{}unknown key \"{}\"; {}", prefix, key,
                             place.empty() ? suggestion(key, known_, "keys")
                                           : fmt::format("it belongs to {}", place)));
  }
  for (const auto& example : required) {
    const auto key = example.substr(0, example.find(' '));
    if (!table_->contains(key)) {
      errors_->add(placeOf(table_->source()),
                   fmt::format("{} has no {}; write {}", header_.empty() ? "the file" : header_,
                               key, example));
    }
  }
}

}  // namespace mpf
