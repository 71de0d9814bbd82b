// SPDX-License-Identifier: MIT
// `mpf doctor`: the checks, for people and for programs.
#include "tests/tools/tools_fixture.h"

namespace mpf::test {
namespace {

using testing::AnyOf;
using testing::HasSubstr;
using testing::IsEmpty;

class DoctorTest : public ToolsTest {};

TEST_F(DoctorTest, ItsExitStatusSaysWhetherThereIsAProblem) {
  const auto ended = run({"doctor", "--json"});

  const auto findings = nlohmann::json::parse(ended.out);
  EXPECT_EQ(findings.size(), 18U);
  bool isIll = false;
  for (const auto& finding : findings) {
    EXPECT_THAT(finding.at("verdict").get<std::string>(),
                AnyOf("ok", "warning", "problem", "unknown"));
    EXPECT_TRUE(finding.at("check").is_string() && finding.at("seen").is_string() &&
                finding.at("remedy").is_string());
    isIll = isIll || finding.at("verdict") == "problem";
  }
  EXPECT_EQ(ended.status, isIll ? 1 : 0);
  EXPECT_THAT(ended.err, IsEmpty());
}

TEST_F(DoctorTest, ItsTextFitsATerminal) {
  const auto ended = run({"doctor"});

  EXPECT_THAT(ended.out, HasSubstr("space in /dev/shm: "));
  std::istringstream text(ended.out);
  for (std::string line; std::getline(text, line);) EXPECT_LE(line.size(), 80U) << line;
}

}  // namespace
}  // namespace mpf::test
