// SPDX-License-Identifier: MIT
#include "crate/config/write_crate.h"

#include "crate/config/process_plan.h"
#include "tests/crate/config/crate_text.h"

namespace mpf::crate::test {
namespace {

using testing::HasSubstr;

using WriteCrateTest = CrateTextTest;

TEST_F(WriteCrateTest, WhatItWritesIsReadAsTheSameCrate) {
  const auto crate = read(R"(
name = "lab-1"
backplane = "b"
location = 3
user = "root"
mode = "0660"
[carriers]
ipac = "model"
"odd name" = "tpci200:0"
[[server]]
program = "serial"
name = "lines"
server = [
  {server = "a", port = "/dev/ttyS0", eomstr = "\\r\\n"},
  {server = "b", port = "/dev/ttyS1", circular = 0},
]
baud = 19200
octal-timing = true
[[server]]
program = "dac128v"
module = "dac"
carrier = "ipac"
site = "IP_a"
queuesize = 20
location = 4
environment = { A = "x \" y", "B.C" = "" }
restart = "never"
[[router]]
serve = "1=0"
listen = ["127.0.0.1:0"]
plain = true
needs = ["dac"]
restart = "on-failure"
[[ioc]]
database = ["a.db", "b.db"]
arguments = ["--macros", "P=x:"]
working-folder = "sub"
[[program]]
name = "viewer"
command = ["viewer", "an argument"]
notify = true
servers = ["v"]
)");

  const auto text = writeCrate(crate, "a heading\nof two lines");
  const auto again = read(text);

  EXPECT_TRUE(text.starts_with("# a heading\n# of two lines\n")) << text;
  EXPECT_EQ(again.name, crate.name);
  EXPECT_EQ(again.location, crate.location);
  EXPECT_EQ(planProcesses(again, "run"), planProcesses(crate, "run")) << text;
}

TEST_F(WriteCrateTest, CommentsCannotEndTheirLine) {
  Crate crate;
  crate.name = "lab";
  auto& process = crate.processes.emplace_back();
  process.name = "v";
  process.command = {"v"};
  process.comment = "a\x01\rb\nsecond";
  EXPECT_THAT(writeCrate(crate, ""), HasSubstr("\n# ab\n# second\n[[program]]\n"));
}

}  // namespace
}  // namespace mpf::crate::test
