// SPDX-License-Identifier: MIT
// Reads one table of a TOML file: values, places, and errors with file and line.
#include "router/config/toml_table.h"

#include <gtest/gtest.h>
#include <stdexcept>
#include <string>
#include <vector>

namespace mpf::router::test {
namespace {

struct Parsed {
  explicit Parsed(const std::string& text) : root(toml::parse(text)) {}
  toml::table root;
  TomlTable table{root, "FILE", ""};
};

// Returns the error that `act` throws, or "nothing".
template <class Act>
std::string complaintOf(Act act) {
  try {
    act();
    return "nothing";
  } catch (const ConfigError& error) {
    return error.what();
  }
}

TEST(TomlTable, ReadsEachTypeAndLeavesAbsentKeysUnchanged) {
  Parsed parsed("name = \"a\"\nnumber = -7\nflag = true\n");
  std::string name;
  std::string absent = "as before";
  std::int32_t number = 0;
  bool flag = false;

  parsed.table.read("name", name);
  parsed.table.read("number", number);
  parsed.table.read("flag", flag);
  parsed.table.read("absent", absent);
  parsed.table.finish();

  EXPECT_EQ(name, "a");
  EXPECT_EQ(number, -7);
  EXPECT_TRUE(flag);
  EXPECT_EQ(absent, "as before");
}

TEST(TomlTable, ReadsOneValueAsAList) {
  Parsed parsed("one = 1\nmany = [2, 3]\n");
  std::vector<std::int32_t> one;
  std::vector<std::int32_t> many;

  parsed.table.read("one", one);
  parsed.table.read("many", many);

  EXPECT_EQ(one, (std::vector<std::int32_t>{1}));
  EXPECT_EQ(many, (std::vector<std::int32_t>{2, 3}));
}

TEST(TomlTable, ErrorsBeginWithFileAndLine) {
  Parsed parsed("a = 1\nname = 2\nother = 3\n");
  std::string name;

  EXPECT_EQ(complaintOf([&] { parsed.table.read("name", name); }).substr(0, 8), "FILE:2: ");
  EXPECT_EQ(complaintOf([&] {
              parsed.table.readWith(
                  "other", [](const std::string&) { throw std::invalid_argument("wrong"); });
            }).substr(0, 8),
            "FILE:3: ");
}

TEST(TomlTable, RefusesKeysThatWereNotReadAndTheAbsenceOfRequiredOnes) {
  Parsed unknown("a = 1\nb = 2\n");
  std::int32_t a = 0;
  unknown.table.read("a", a);

  EXPECT_EQ(complaintOf([&] { unknown.table.finish(); }).substr(0, 8), "FILE:2: ");
  EXPECT_NE(complaintOf([&] { Parsed("").table.finish({"location = 1"}); }).find("location = 1"),
            std::string::npos);
}

TEST(TomlTable, ReadsTablesWithTheirPlaces) {
  Parsed parsed("[tls]\nkey = \"k\"\n[[serve]]\nlocation = 1\n[[serve]]\nlocation = 2\n");
  std::vector<std::int32_t> locations;
  std::string key;
  std::string place;

  parsed.table.readTable("tls", [&](TomlTable& table) { table.read("key", key); });
  parsed.table.readTables("serve", [&](TomlTable& table) {
    table.read("location", locations.emplace_back());
    place = table.places().of("location");
  });

  EXPECT_EQ(key, "k");
  EXPECT_EQ(locations, (std::vector<std::int32_t>{1, 2}));
  EXPECT_EQ(place, "FILE:6");
}

}  // namespace
}  // namespace mpf::router::test
