// SPDX-License-Identifier: MIT
// The table of programs has the arguments and options that their --help shows.
#include "crate/config/program_kinds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "tests/support/command.h"

namespace mpf::crate::test {
namespace {

using testing::ElementsAre;

const std::map<std::string, std::string> kPrograms{
    {"serial", MPF_TEST_SERIAL_SERVER},   {"gpib", MPF_TEST_GPIB_SERVER},
    {"dac128v", MPF_TEST_DAC128V_SERVER}, {"digital-io", MPF_TEST_DIGITAL_IO_SERVER},
    {"ip330", MPF_TEST_IP330_SERVER},     {"ip440", MPF_TEST_IP440_SERVER},
    {"int32", MPF_TEST_INT32_SERVER},     {"char8-array", MPF_TEST_CHAR8_ARRAY_SERVER},
    {"router", MPF_TEST_ROUTER}};

struct Help {
  std::vector<std::string> positionals;
  std::set<std::string> options;
};

// The names at the beginning of the lines of --help.
Help helpOf(const std::string& program) {
  Help help;
  std::istringstream lines(mpf::test::runCommand(program + " --help").output);
  bool isPositional = false;
  const std::regex option("^  (?:-.,)?--([a-z0-9-]+) .*");
  const std::regex positional("^  ([a-z0-9]+) .*");
  for (std::string line; std::getline(lines, line);) {
    if (line == "Positionals:") isPositional = true;
    if (line == "Options:") isPositional = false;
    std::smatch found;
    if (std::regex_match(line, found, option)) help.options.insert(found[1]);
    else if (isPositional && std::regex_match(line, found, positional))
      help.positionals.push_back(found[1]);
  }
  return help;
}

TEST(ProgramKinds, HaveThePositionalsOfTheirPrograms) {
  for (const auto& [name, program] : kPrograms)
    EXPECT_EQ(findKind(name)->positionals, helpOf(program).positionals) << name;
}

TEST(ProgramKinds, HaveTheOptionsOfTheirPrograms) {
  // Options that a crate gives by its own keys, or that make no sense in a crate.
  const std::set<std::string> others{"help",     "version", "carrier",  "wires", "backplane",
                                     "location", "check",   "ready-fd", "name"};
  for (const auto& [name, program] : kPrograms) {
    SCOPED_TRACE(name);
    const auto help = helpOf(program);
    std::set<std::string> expected;
    for (const auto& option : help.options)
      if (!others.contains(option)) expected.insert(option);
    std::set<std::string> options;
    const auto keys = findKind(name)->keys();
    for (const auto& key : keys) {
      const auto isPositional = std::ranges::find(help.positionals, key) != help.positionals.end();
      if (!isPositional || findKind(name)->findOption(key) != nullptr) options.insert(key);
    }
    EXPECT_EQ(options, expected);
  }
}

TEST(ProgramKinds, NoOtherKindNeedsATest) {
  for (const auto& kind : programKinds())
    EXPECT_TRUE(kPrograms.contains(kind.name) || kind.name == "ioc") << kind.name;
}

Process processOf(const std::string& kind, std::vector<Setting> settings) {
  Process process;
  process.kind = kind;
  process.settings = std::move(settings);
  return process;
}

// Otherwise the supervisor would report a program ready before clients find its servers.
TEST(ServersOf, EachKindOfServerHasAName) {
  for (const auto& kind : programKinds()) {
    if (kind.entry != Entry::server) continue;
    std::vector<Setting> settings;
    for (const auto& key : kind.positionals) settings.push_back({key, {"a"}, {}});
    EXPECT_THAT(serversOf(processOf(kind.name, std::move(settings))),
                testing::Contains(testing::StartsWith("a")))
        << kind.name;
  }
}

TEST(ServersOf, AreTheNamesThatClientsBindTo) {
  EXPECT_THAT(serversOf(processOf("dac128v", {{"module", {"dac"}, {}}})), ElementsAre("dac"));
  EXPECT_THAT(serversOf(processOf("digital-io", {{"module", {"dio"}, {}}})),
              ElementsAre("dioIn", "dioOut"));
  EXPECT_THAT(serversOf(processOf("ip330", {{"module", {"adc"}, {}}})),
              ElementsAre("adc", "adcConfig"));
  EXPECT_THAT(serversOf(processOf("ip330", {{"module", {"adc"}, {}},
                                            {"scan", {"s,0,15", "t"}, {}},
                                            {"pid", {"p,0,dac,1"}, {}}})),
              ElementsAre("s", "t", "p"));
  EXPECT_THAT(serversOf(processOf("serial", {{"server", {"a[0],UART0", "a[1],UART1"}, {}}})),
              ElementsAre("a[0]", "a[1]"));
  EXPECT_THAT(serversOf(processOf("gpib", {{"server", {"GPIB0"}, {}}})), ElementsAre("GPIB0"));
  EXPECT_THAT(serversOf(processOf("int32", {})), ElementsAre("Int32"));
}

TEST(ModulesOf, AreAllThatAProcessDrives) {
  const auto modules = modulesOf(processOf("ip330", {{"module", {"adc"}, {}},
                                                     {"carrier", {"ipac"}, "1"},
                                                     {"site", {"IP_a"}, {}},
                                                     {"dac", {"d,ipac,IP_b"}, "2"}}));

  ASSERT_EQ(modules.size(), 2U);
  EXPECT_EQ(modules[0].carrier + modules[0].site + modules[0].place, "ipacIP_a1");
  EXPECT_EQ(modules[1].carrier + modules[1].site + modules[1].place, "ipacIP_b2");
}

}  // namespace
}  // namespace mpf::crate::test
