// SPDX-License-Identifier: MIT
// TomlTable: one table of a configuration file, read key by key. Errors are collected, each with
// file, line and column, so that a reader continues and finds them all.
//
//   const auto root = parseTomlFile(file);
//   ConfigErrors errors;
//   TomlTable table(root, file, "", errors);
//   table.read("location", serve.location);   // no change when the key is absent or invalid
//   table.finish();                           // after all reads: refuses all other keys
//   errors.throwIfAny();
//
// Threads  one.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <toml++/toml.h>
#include <utility>
#include <vector>

#include "base/toml/config_errors.h"

namespace mpf {

//   throws  ConfigError when the file cannot be read or is not TOML
[[nodiscard]] toml::table parseTomlFile(const std::string& file);

// What the user probably meant: "did you mean "location"?", or a list of all that is possible.
[[nodiscard]] std::string suggestion(std::string_view written,
                                     const std::vector<std::string>& possible,
                                     std::string_view plural);

class TomlTable {
 public:
  // `header` is the written form: "[tls]", "[[listen]]", or empty for the root table of the file.
  // `table` and `errors` outlive this object.
  TomlTable(const toml::table& table, std::string file, std::string header, ConfigErrors& errors);

  void read(const char* key, std::string& value);
  void read(const char* key, std::int32_t& value);
  void read(const char* key, bool& value);
  // Reads one value or a list of values.
  void read(const char* key, std::vector<std::int32_t>& values);
  void read(const char* key, std::vector<std::string>& values);
  // Passes a string or an integer, as text, to `use`, which throws std::invalid_argument when the
  // value is wrong.
  void readWith(const char* key, const std::function<void(const std::string&)>& use);
  // Returns the value of a key of any type; nullptr when it is absent.
  const toml::node* find(const char* key);

  // Calls `use` with the table [key], if it exists, or with each table [[key]].
  void readTable(const char* key, const std::function<void(TomlTable&)>& use);
  void readTables(const char* key, const std::function<void(TomlTable&)>& use);
  // Calls `use` with the name and the value of each key of the table [key].
  void readNamed(const char* key,
                 const std::function<void(const std::string&, const toml::node&)>& use);

  // Refuses keys that were not read, and then the absence of a required key.
  //   required    an example for each required key: "location = 1"
  //   placeOfKey  says to which other table of the file a key belongs: "[tls]"; empty: to none
  void finish(const std::vector<std::string>& required = {},
              const std::function<std::string(const std::string& key)>& placeOfKey = {}) const;

  // Adds an error at the value of a key.
  void refuse(const toml::node& node, const std::string& text) const;
  [[nodiscard]] std::string placeOf(const toml::node& node) const;
  // The places of all keys.
  [[nodiscard]] Places places() const;
  [[nodiscard]] ConfigErrors& errors() const noexcept { return *errors_; }
  [[nodiscard]] const std::string& file() const noexcept { return file_; }

 private:
  template <class Value>
  std::optional<Value> take(const char* key, const toml::node& node, const char* wanted) const;
  [[nodiscard]] std::optional<std::int32_t> takeInt32(const char* key,
                                                      const toml::node& node) const;
  // Calls `use` with the value of a key, or with each value of its list.
  void takeEach(const char* key, const std::function<void(const toml::node&)>& use);
  [[nodiscard]] std::string placeOf(const toml::source_region& source) const;

  const toml::table* table_;
  std::string file_;
  std::string header_;
  ConfigErrors* errors_;
  std::vector<std::string> known_;
};

// "a string", "an integer": what a value is.
[[nodiscard]] const char* kindOf(const toml::node& node);

}  // namespace mpf
