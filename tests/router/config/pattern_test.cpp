// SPDX-License-Identifier: MIT
// Patterns with * and ?.
#include <gtest/gtest.h>
#include <string>
#include <utility>
#include <vector>

#include "router/config/router_config.h"

namespace mpf::router::test {
namespace {

TEST(RouterPattern, StarsStandForAnythingAndQuestionMarksForOne) {
  for (const auto& [pattern, name] :
       std::vector<std::pair<std::string, std::string>>{{"", ""},
                                                        {"*", ""},
                                                        {"*", "a"},
                                                        {"a", "a"},
                                                        {"a*", "a"},
                                                        {"a*c", "abbc"},
                                                        {"a?c", "abc"},
                                                        {"*.lab", "ioc1.lab"},
                                                        {"ioc?.*", "ioc1.lab"},
                                                        {"*ab*ab", "abxabyab"},
                                                        {"**", "x"},
                                                        {"serial[0]", "serial[0]"},
                                                        {"*a*b*", "xxaxxbxx"}}) {
    EXPECT_TRUE(matches(pattern, name)) << pattern << " " << name;
  }
  for (const auto& [pattern, name] :
       std::vector<std::pair<std::string, std::string>>{{"", "a"},
                                                        {"a", ""},
                                                        {"?", ""},
                                                        {"a", "A"},
                                                        {"a", "ab"},
                                                        {"a*c", "abcd"},
                                                        {"a?c", "ac"},
                                                        {"*.lab", "ioc1.lab.x"},
                                                        {"*ab*ab", "xab"},
                                                        {"serial[0]", "serial0"}}) {
    EXPECT_FALSE(matches(pattern, name)) << pattern << " " << name;
  }
}

// A peer chooses its own name: matching takes at most the product of both lengths.
TEST(RouterPattern, ManyStarsAreMatchedQuickly) {
  std::string pattern;
  for (int i = 0; i < 1000; ++i) pattern += "*a";

  EXPECT_FALSE(matches(pattern + "b", std::string(5000, 'a')));
}

}  // namespace
}  // namespace mpf::router::test
