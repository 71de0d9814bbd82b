// SPDX-License-Identifier: MIT
// What ls, mrr and msr have in common: backplanes, the documented JSON fields.
#include <fstream>
#include <set>

#include "tests/support/test_backplane.h"
#include "tests/tools/report/report_fixture.h"

namespace mpf::test {
namespace {

using testing::StartsWith;

TEST_F(ReportTest, ReportsAnEmptyBackplane) {
  for (const std::string report : {"ls", "mrr", "msr", "inspect"})
    EXPECT_THAT(run({report}).out,
                StartsWith("backplane " + backplane_.name() + " has no process"));
  EXPECT_EQ(report({"msr"}), nlohmann::json::array());
}

void addKeys(const nlohmann::json& json, std::set<std::string>& keys) {
  if (!json.is_structured()) return;
  for (const auto& [key, value] : json.items()) {
    if (json.is_object()) keys.insert(key);
    addKeys(value, keys);
  }
}

// docs/tools.md describes each JSON field.
TEST_F(ReportTest, EachJsonFieldIsDocumented) {
  openServer("echo");
  connect();
  MessageClient second(*dispatcher_, [](const Message&) {});
  second.bind("later", 0);
  while (ls().at("waiting").empty()) dispatcher_->runOnce(Deadline::after(100us));
  std::set<std::string> keys;
  addKeys(ls(), keys);
  addKeys(report({"msr", "echo"}), keys);
  auto call =
      nlohmann::json::parse(run({"call", "nobody", "int32", "--timeout", "0.01", "--json"}).out);
  call.at("why").clear();  // its keys are reasons
  addKeys(call, keys);
  std::ostringstream document;
  document << std::ifstream(MPF_TEST_TOOLS_MD).rdbuf();

  for (const auto& key : keys)
    EXPECT_NE(document.str().find("`" + key + "`"), std::string::npos) << key;
  EXPECT_GT(keys.size(), 40U);
}

TEST_F(ReportTest, ReportsAllBackplanesWithoutAName) {
  const MessageServer here(backplane_, "here");
  const TestBackplane elsewhere;
  const MessageServer there(elsewhere, "there");

  const auto ended = runTool({"msr", "--json", "--interval", "1ms"}, "");

  EXPECT_EQ(ended.status, 0);
  const auto all = nlohmann::json::parse(ended.out);
  EXPECT_EQ(entryOf(all, "backplane", backplane_.name()).at("name"), "here");
  EXPECT_EQ(entryOf(all, "backplane", elsewhere.name()).at("name"), "there");
}

TEST_F(ReportTest, AnArgumentOverridesTheEnvironment) {
  const MessageServer server(backplane_, "here");

  const auto ended = runTool({"msr", "--backplane", backplane_.name()}, "another");

  EXPECT_THAT(ended.out, StartsWith("here\n"));
}

}  // namespace
}  // namespace mpf::test
