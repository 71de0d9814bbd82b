// SPDX-License-Identifier: MIT
// crateSchema(): has the keys that readCrate() accepts.
#include "crate/config/crate_schema.h"

#include <regex>
#include <set>

#include "crate/config/program_kinds.h"
#include "tests/crate/config/crate_text.h"

namespace mpf::crate::test {
namespace {

using testing::HasSubstr;

std::set<std::string> keysOf(const nlohmann::ordered_json& table) {
  std::set<std::string> keys;
  for (const auto& [key, value] : table.at("properties").items()) keys.insert(key);
  return keys;
}

// The keys that the error for an unknown key lists.
std::set<std::string> keysIn(const std::string& errors) {
  constexpr std::string_view kBegin = "the keys are ";
  const auto line = errors.substr(errors.find(kBegin) + kBegin.size());
  std::istringstream words(line.substr(0, line.find('\n')));
  std::set<std::string> keys;
  for (std::string key; words >> key;) {
    if (key.ends_with(',')) key.pop_back();
    keys.insert(key);
  }
  return keys;
}

using CrateSchemaTest = CrateTextTest;

TEST_F(CrateSchemaTest, HasTheKeysOfTheCrate) {
  EXPECT_EQ(keysOf(crateSchema()), keysIn(errorsOf("qqqqqqqqqqqqqqqqqqqq = 1\n")));
}

// An editor accepts the times that readCrate() accepts.
TEST_F(CrateSchemaTest, AcceptsTheTimesOfACrate) {
  const auto keys = crateSchema()["properties"]["supervision"]["properties"];
  const std::regex time(keys["stop-time"]["pattern"].get<std::string>());
  for (const std::string text : {"500ms", "2s", "10min", "1.5min", "0.25s", "", "5", "0s", "0.0s",
                                 "1h", "1 s", "-1s", "off"}) {
    const auto errors =
        errorsOf("[supervision]\nstop-time = \"" + text + "\"\n[[server]]\nprogram = \"int32\"\n");
    EXPECT_EQ(std::regex_search(text, time), errors.empty()) << text << errors;
  }
  const std::regex timeOrOff(keys["stall-limit"]["pattern"].get<std::string>());
  EXPECT_TRUE(std::regex_search("off", timeOrOff));
  EXPECT_TRUE(std::regex_search("1.5s", timeOrOff));
  EXPECT_FALSE(std::regex_search("0s", timeOrOff));
}

TEST_F(CrateSchemaTest, HasTheKeysOfEachProgram) {
  const auto schema = crateSchema();
  std::map<std::string, nlohmann::ordered_json> servers;
  for (const auto& one : schema["properties"]["server"]["items"]["oneOf"])
    servers[one["properties"]["program"]["const"]] = one;
  for (const auto& kind : programKinds()) {
    SCOPED_TRACE(kind.name);
    const auto isServer = kind.entry == Entry::server;
    const auto entry = isServer ? "server" : kind.name;
    const auto table =
        isServer ? servers.at(kind.name) : schema["properties"][entry]["items"]["oneOf"][0];
    const auto errors =
        errorsOf("[[" + entry + "]]\n" + (isServer ? "program = \"" + kind.name + "\"\n" : "") +
                 "qqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqq = 1\n");
    EXPECT_EQ(keysOf(table), keysIn(errors));
    const auto command = keysIn(errorsOf("[[program]]\nqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqq = 1\n"));
    EXPECT_EQ(keysOf(schema["properties"]["program"]["items"]), command);
  }
}

}  // namespace
}  // namespace mpf::crate::test
