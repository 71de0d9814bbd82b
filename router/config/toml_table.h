// SPDX-License-Identifier: MIT
// TomlTable: one table of a configuration file, read key by key. Each error is a ConfigError that
// begins with the file and the line.
//
//   TomlTable table(root, "FILE", "");
//   table.read("location", serve.location);   // no change when the key is absent
//   table.finish();                           // after all reads: refuses all other keys
//
// Threads  one.
#pragma once

#include <functional>
#include <string>
#include <toml++/toml.h>
#include <utility>
#include <vector>

#include "router/config/written_config.h"

namespace mpf::router {

class TomlTable {
 public:
  // `header` is the written form: "[tls]", "[[listen]]", or empty for the root table of the file.
  // `table` outlives this object.
  TomlTable(const toml::table& table, std::string file, std::string header);

  void read(const char* key, std::string& value);
  void read(const char* key, std::int32_t& value);
  void read(const char* key, bool& value);
  // Reads one value or a list of values.
  void read(const char* key, std::vector<std::int32_t>& values);
  void read(const char* key, std::vector<std::string>& values);
  // Passes a string or an integer, as text, to `use`, which throws std::invalid_argument when the
  // value is wrong.
  void readWith(const char* key, const std::function<void(const std::string&)>& use);

  // Calls `use` with the table [key], if it exists, or with each table [[key]].
  void readTable(const char* key, const std::function<void(TomlTable&)>& use);
  void readTables(const char* key, const std::function<void(TomlTable&)>& use);

  // Refuses keys that were not read, and then the absence of a required key. `required` has an
  // example for each required key: "location = 1".
  void finish(const std::vector<std::string>& required = {}) const;

  // The places of all keys.
  [[nodiscard]] Places places() const;

 private:
  const toml::node* find(const char* key);
  template <class Value>
  Value take(const char* key, const toml::node& node, const char* wanted) const;
  [[nodiscard]] std::int32_t takeInt32(const char* key, const toml::node& node) const;
  void takeEach(const char* key, const std::function<void(const toml::node&)>& use);
  [[nodiscard]] std::string placeOf(const toml::source_region& source) const;
  [[nodiscard]] ConfigError unknown(const toml::key& key) const;

  const toml::table* table_;
  std::string file_;
  std::string header_;
  std::vector<std::string> known_;
};

}  // namespace mpf::router
