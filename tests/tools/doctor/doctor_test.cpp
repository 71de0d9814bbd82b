// SPDX-License-Identifier: MIT
// `mpf doctor`: its output as text and as JSON.
#include "tests/tools/tools_fixture.h"

namespace mpf::test {
namespace {

using testing::AnyOf;
using testing::HasSubstr;
using testing::IsEmpty;

class DoctorTest : public ToolsTest {};

TEST_F(DoctorTest, ExitStatusIsOneForAProblem) {
  const auto ended = run({"doctor", "--json"});

  const auto findings = nlohmann::json::parse(ended.out);
  EXPECT_EQ(findings.size(), 18U);
  bool hasProblem = false;
  for (const auto& finding : findings) {
    EXPECT_THAT(finding.at("verdict").get<std::string>(),
                AnyOf("ok", "warning", "problem", "unknown"));
    EXPECT_TRUE(finding.at("check").is_string() && finding.at("seen").is_string() &&
                finding.at("remedy").is_string());
    hasProblem = hasProblem || finding.at("verdict") == "problem";
  }
  EXPECT_EQ(ended.status, hasProblem ? 1 : 0);
  EXPECT_THAT(ended.err, IsEmpty());
}

TEST_F(DoctorTest, TextFitsEightyColumns) {
  const auto ended = run({"doctor"});

  EXPECT_THAT(ended.out, HasSubstr("space in /dev/shm: "));
  std::istringstream text(ended.out);
  for (std::string line; std::getline(text, line);) EXPECT_LE(line.size(), 80U) << line;
}

}  // namespace
}  // namespace mpf::test
