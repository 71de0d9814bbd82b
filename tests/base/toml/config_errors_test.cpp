// SPDX-License-Identifier: MIT
// ConfigErrors: the order of the errors of a file.
#include "base/toml/config_errors.h"

#include <gtest/gtest.h>

namespace mpf {
namespace {

std::string textOf(const ConfigErrors& errors) try {
  errors.throwIfAny();
  return {};
} catch (const ConfigError& error) {
  return error.what();
}

TEST(ConfigErrors, AreInTheOrderOfTheirLinesAndColumns) {
  ConfigErrors errors;
  EXPECT_EQ(textOf(errors), "");
  errors.add("--listen", "without a line");
  errors.add("a:b.toml:10:1", "fourth");
  errors.add("a:b.toml:9:12", "second");
  errors.add("a:b.toml:10:1", "fifth");
  errors.add("a:b.toml:9:2", "first");
  errors.add("a:b.toml:9:13", "third");
  errors.add("", "without a place");

  EXPECT_EQ(textOf(errors),
            "a:b.toml:9:2: first\na:b.toml:9:12: second\n"
            "a:b.toml:9:13: third\na:b.toml:10:1: fourth\na:b.toml:10:1: fifth\n"
            "--listen: without a line\nwithout a place");
}

}  // namespace
}  // namespace mpf
