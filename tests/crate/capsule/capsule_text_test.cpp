// SPDX-License-Identifier: MIT
// capsuleText(): what happened comes first; any JSON is shown.
#include "crate/capsule/capsule_text.h"

#include <gmock/gmock.h>

namespace mpf::crate::test {
namespace {

using nlohmann::ordered_json;

TEST(CapsuleText, SaysFirstWhatHappened) {
  const ordered_json candidate{{"client", "viewer"}, {"clientPid", 12}};
  const ordered_json handling{
      {"type", "int32"}, {"cmd", 3}, {"candidates", ordered_json::array({candidate})}};
  const ordered_json server{{"name", "com1"}, {"handling", handling}};
  const ordered_json capsule{{"process", "serial"},
                             {"cause", {{"kind", "signal"}, {"name", "SIGSEGV"}}},
                             {"upNs", 12'400'000'000},
                             {"servers", ordered_json::array({server})}};

  EXPECT_EQ(capsuleSummary(capsule),
            "\"serial\" died by SIGSEGV 12.4 s after its start, while its server \"com1\" handled "
            "int32 cmd 3 of client viewer pid 12.");
  EXPECT_THAT(capsuleText(capsule), testing::StartsWith("\"serial\" died by SIGSEGV"));
}

TEST(CapsuleText, ShowsTheFolderOfTheCommand) {
  const ordered_json capsule{{"command", {"../psu_server", "psu"}}, {"folder", "/opt/lab"}};

  EXPECT_THAT(capsuleText(capsule),
              testing::HasSubstr("  command  ../psu_server psu\n  folder   /opt/lab\n"));
}

TEST(CapsuleText, ShowsAnyJson) {
  for (const auto* const text :
       {"{}", R"({"servers": 3, "log": 7, "command": "x"})",
        R"({"servers": [1, {"handling": {"candidates": 5}, "links": [[], {"requests": 2}]}]})"})
    EXPECT_THAT(capsuleText(ordered_json::parse(text)), testing::HasSubstr("after its start"));
}

}  // namespace
}  // namespace mpf::crate::test
