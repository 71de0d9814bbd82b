// SPDX-License-Identifier: MIT
// Reads one table of a TOML file: values, places, and errors with their places.
#include "base/toml/toml_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdexcept>
#include <string>
#include <vector>

namespace mpf::test {
namespace {

using testing::ElementsAre;

struct Parsed {
  explicit Parsed(const std::string& text) : root(toml::parse(text)) {}
  toml::table root;
  ConfigErrors errors;
  TomlTable table{root, "FILE", "", errors};
};

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

TEST(TomlTable, CollectsAllErrorsWithTheirPlaces) {
  Parsed parsed("a = 1\nname = 2\nother =  3\n");
  std::string name = "as before";

  parsed.table.read("name", name);
  parsed.table.readWith("other", [](const std::string&) { throw std::invalid_argument("wrong"); });
  parsed.table.finish({"location = 1"});

  EXPECT_EQ(name, "as before");
  EXPECT_THAT(parsed.errors.lines(),
              ElementsAre("FILE:2:8: name is an integer; write a string in quotes",
                          "FILE:3:10: other: wrong",
                          "FILE:1:1: unknown key \"a\"; the keys are name, other",
                          "FILE:1:1: the file has no location; write location = 1"));
}

TEST(TomlTable, ReadsTheNamesOfATable) {
  Parsed parsed("[carrier]\nipac = \"model\"\nother = \"model\"\n");
  std::vector<std::string> names;

  parsed.table.readNamed("carrier", [&](const std::string& name, const toml::node& value) {
    names.push_back(name);
    EXPECT_TRUE(value.is_string());
  });

  EXPECT_THAT(names, ElementsAre("ipac", "other"));
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
  EXPECT_EQ(place, "FILE:6:12");
}

}  // namespace
}  // namespace mpf::test
