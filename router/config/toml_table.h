// SPDX-License-Identifier: MIT
// TomlTable: one table of a configuration file, read key by key. Whatever is wrong is a ConfigError
// that begins with file and line.
//
//   TomlTable table(root, "FILE", "");
//   table.read("location", serve.location);   // leaves it as it is when the key is not there
//   table.finish();                           // after all reads: they say which keys there are
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
  // `header` as it is written: "[tls]", "[[listen]]"; empty: the file itself. `table` must outlive
  // this object.
  TomlTable(const toml::table& table, std::string file, std::string header);

  void read(const char* key, std::string& value);
  void read(const char* key, std::int32_t& value);
  void read(const char* key, bool& value);
  // One value, or a list of them.
  void read(const char* key, std::vector<std::int32_t>& values);
  void read(const char* key, std::vector<std::string>& values);
  // Hands a string or an integer, as text, to `use`, whose std::invalid_argument says what is wrong
  // with it.
  void readWith(const char* key, const std::function<void(const std::string&)>& use);

  // Calls `use` with [key], if it is there, or with each [[key]].
  void readTable(const char* key, const std::function<void(TomlTable&)>& use);
  void readTables(const char* key, const std::function<void(TomlTable&)>& use);

  // Refuses keys that no read asked for, then that one of `required` is not there. Each shows how
  // it may be written: "location = 1".
  void finish(const std::vector<std::string>& required = {}) const;

  // Where all keys are.
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
