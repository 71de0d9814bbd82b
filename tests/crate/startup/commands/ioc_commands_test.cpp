// SPDX-License-Identifier: MIT
#include "tests/crate/startup/commands/startup_scene.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class IocCommands : public StartupScene {
 protected:
  IocCommands() {
    std::filesystem::create_directory(folder_.path() / "ip");
    static_cast<void>(folder_.write("ip/meter.db", ""));
    options_.symbols["ip"] = folder_.file("ip");
  }
  // The commands for the IOC, without comments and the folder.
  std::string iocOf(const std::string& text) {
    std::istringstream lines(read(text).iocText);
    std::string commands;
    for (std::string line; std::getline(lines, line);)
      if (!line.starts_with("#")) commands += line + "\n";
    const auto folder = folder_.path().string();
    for (auto at = commands.find(folder); at != std::string::npos; at = commands.find(folder))
      commands.replace(at, folder.size(), "HERE");
    return commands;
  }
};

TEST_F(IocCommands, DatabasesAreFoundInTheFolderOfTheirArgument) {
  EXPECT_EQ(iocOf("dbLoadRecords(\"meter.db\", \"P=x:,C=0\", ip)\ncd \"ip\"\n"
                  "dbLoadRecords \"meter.db\"\ndbLoadTemplate(\"meter.db\")\niocInit\n"),
            "dbLoadRecords(\"HERE/ip/meter.db\", \"P=x:,C=0\")\n"
            "dbLoadRecords(\"HERE/ip/meter.db\", \"\")\n"
            "dbLoadTemplate(\"HERE/ip/meter.db\")\niocInit\n");
}

TEST_F(IocCommands, DbLoadDatabaseLoadsRecordsUnlessItDescribesTypes) {
  EXPECT_EQ(iocOf("dbLoadDatabase(\"../../dbd/site.dbd\")\n"
                  "dbLoadDatabase(\"meter.db\", ip, \"P=x:\")\niocInit\n"),
            "dbLoadRecords(\"HERE/ip/meter.db\", \"P=x:\")\niocInit\n");
}

TEST_F(IocCommands, AFileThatDoesNotExistIsSkippedAndNamed) {
  const auto startup = read("dbLoadRecords(\"none.db\", \"P=x:\", ip)\niocInit\n");
  EXPECT_THAT(remarksOf(startup),
              ElementsAre(HasSubstr(
                  "dbLoadRecords of none.db is skipped: there is no such file (looked for " +
                  folder_.file("none.db"))));
}

TEST_F(IocCommands, TheIocIsAProcessWithTheEnvironmentOfTheFile) {
  const auto startup = read("putenv(\"EPICS_CA_ADDR_LIST=10.0.0.255\")\niocInit\n");

  ASSERT_EQ(startup.crate.processes.size(), 1u);
  const auto& ioc = startup.crate.processes.at(0);
  EXPECT_EQ(ioc.kind, "ioc");
  EXPECT_TRUE(ioc.notifies);
  EXPECT_THAT(settingsOf(startup, "ioc"), ElementsAre("startup=ioc.cmd"));
  EXPECT_EQ(ioc.environment.at("EPICS_CA_ADDR_LIST"), "10.0.0.255");
}

TEST_F(IocCommands, OtherCommandsArePassedOnWithTheirLine) {
  EXPECT_EQ(read("iocInit()\ndbpf \"a.CALC\",\"A==\\\"x\\\"?1:0\"\nmrr\ndbpf(\"b\", 5)\n").iocText,
            "# st.cmd:1: iocInit()\niocInit\n"
            "# st.cmd:2: dbpf \"a.CALC\",\"A==\\\"x\\\"?1:0\"\ndbpf(\"a.CALC\", 'A==\"x\"?1:0')\n"
            "# st.cmd:3: mrr\nmrr\n"
            "# st.cmd:4: dbpf(\"b\", 5)\ndbpf(\"b\", \"5\")\n");
}

TEST_F(IocCommands, ATextThatIocshCannotReadIsAnError) {
  EXPECT_THAT(errorOf("dbpf(\"x.DESC\", \"a\\nb\")\niocInit\n"),
              HasSubstr("dbpf: the argument \"a\\nb\" contains a control character"));
  EXPECT_THAT(errorOf("dbpf(\"x.DESC\", \"a'b\\\"c\")\niocInit\n"),
              HasSubstr("contains both kinds of quotes"));
  EXPECT_THAT(errorOf("dbLoadRecords(\"meter.db\", \"P=x:\\r\", ip)\niocInit\n"),
              HasSubstr("1:27: error: dbLoadRecords: the argument \"P=x:\\r\" contains"));
}

TEST_F(IocCommands, ReportsAloneNeedNoIoc) {
  EXPECT_THAT(errorOf("mrr\nmsr \"adc\"\n"), HasSubstr("no command of the file starts"));
}

}  // namespace
}  // namespace mpf::test
