// SPDX-License-Identifier: MIT
#include "crate/startup/shell/macros.h"

#include <gtest/gtest.h>
#include <map>
#include <set>
#include <string>

#include "crate/startup/shell/line_error.h"

namespace mpf::test {
namespace {

std::string expanded(const std::string& text) {
  static const std::map<std::string, std::string> values = {
      {"TOP", "/top"}, {"A", "$(B)"}, {"B", "b"}, {"NAME", "TOP"}, {"LOOP", "$(LOOP)$(LOOP)"}};
  std::set<std::string> undefined;
  auto result = startup::expandMacros(text, values, undefined);
  for (const auto& name : undefined) result += " undefined " + name;
  return result;
}

TEST(MacrosTest, AreReplaced) {
  EXPECT_EQ(expanded("cd $(TOP)/x ${TOP}"), "cd /top/x /top");
  EXPECT_EQ(expanded("$(A) $($(NAME))"), "b /top");
  EXPECT_EQ(expanded("$(X=1) $(X=$(TOP)) $(TOP=2)"), "1 /top /top");
}

TEST(MacrosTest, WithoutValueStay) {
  EXPECT_EQ(expanded("$(X)"), "$(X) undefined X");
  EXPECT_EQ(expanded("$ $( $(TOP $(TOP} $x"), "$ $( $(TOP $(TOP} $x");
}

TEST(MacrosTest, ThatContainThemselvesAreAnError) {
  EXPECT_THROW(expanded("$(LOOP)"), startup::LineError);
}

TEST(MacrosTest, LimitTheLength) {
  std::map<std::string, std::string> values{{"M0", "0123456789"}};
  for (int i = 1; i < 12; ++i) {
    std::string value;
    for (int n = 0; n < 10; ++n) value += "$(M" + std::to_string(i - 1) + ")";
    values["M" + std::to_string(i)] = value;
  }
  std::set<std::string> undefined;

  EXPECT_THROW(static_cast<void>(startup::expandMacros("$(M11)", values, undefined)),
               startup::LineError);
}

}  // namespace
}  // namespace mpf::test
