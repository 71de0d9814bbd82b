// SPDX-License-Identifier: MIT
#include "crate/startup/shell/dialect.h"

#include <gtest/gtest.h>

namespace mpf::test {
namespace {

using enum startup::Dialect;
using startup::detectDialect;

TEST(DialectTest, SignsOfVxWorks) {
  for (const auto* line : {"x = 1\n", "ld < lib\n", "f(1) /* x */\n", "strcat(a, \"b\")\n"})
    EXPECT_EQ(detectDialect(line, iocsh), vxWorks) << line;
}

TEST(DialectTest, SignsOfIocsh) {
  for (const auto* line : {"#!../bin/ioc\nx=1\n", "< envPaths\n", "var x 1\n", "var\n",
                           "epicsEnvSet A B\n", "cd $(TOP)\n", "cd ${TOP}\n"})
    EXPECT_EQ(detectDialect(line, vxWorks), iocsh) << line;
}

TEST(DialectTest, CommonLanguageIsThatOfTheIncludingFile) {
  for (const auto* text : {"", "routerInit\n# x = 1 $(Y)\nf(\"$(STD)/a = b /*\", 1)\n",
                           "epicsEnvSet(\"A\",\"B\")\n"}) {
    EXPECT_EQ(detectDialect(text, iocsh), iocsh) << text;
    EXPECT_EQ(detectDialect(text, vxWorks), vxWorks) << text;
  }
}

TEST(DialectTest, MajorityOfSignsDecides) {
  EXPECT_EQ(detectDialect("x = 1\ny = 2\nvar z 1\n", iocsh), vxWorks);
}

}  // namespace
}  // namespace mpf::test
