// SPDX-License-Identifier: MIT
// `mpf gpib-sniff`: the bytes of a bus, in each format.
#include <thread>

#include "server/programs/gpib_server/sniff_source.h"
#include "tests/drivers/gpib/fake_controller.h"
#include "tests/tools/tools_fixture.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;
using testing::ContainsRegex;
using testing::HasSubstr;

class GpibSniffToolTest : public testing::Test {
 protected:
  void SetUp() override {
    sniff_.start([] { ADD_FAILURE() << "the sniff server failed"; });
  }
  // Returns when the tool listens, and both it and the server have noticed.
  std::unique_ptr<Tool> listen(std::vector<std::string> more = {}) {
    std::vector<std::string> arguments{"gpib-sniff", "gpib", "0"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    auto tool = std::make_unique<Tool>(arguments, backplane_.name());
    while (sniff_.listeners() == 0 || tool->err().find("listening to") == std::string::npos)
      std::this_thread::yield();
    return tool;
  }
  void talk(const std::string& text) {
    EXPECT_TRUE(bus_.writeRead({22}, bytesOf(text), {.maxBytes = 99}, Deadline::after(60s)).ok());
  }

  Watchdog watchdog_{"gpib-sniff test"};
  ServerLog log_{"test", "off"};
  FakeGpib fake_;
  GpibBus bus_{fake_.makeController()};
  TestBackplane backplane_;
  SniffServer sniff_{backplane_, "gpib", {}, sniffSourceOf(bus_), log_};
};

TEST_F(GpibSniffToolTest, PrintsTheFormatOfTheManual) {
  const auto tool = listen();
  talk("ID?\n");

  tool->signal(SIGINT);

  const auto ended = tool->end();
  EXPECT_EQ(ended.status, 0);
  EXPECT_EQ(ended.out, "R\nTID? 0x0a\nRID? 0x0a\ngpibSniff done\n");
  EXPECT_EQ(ended.err,
            "mpf gpib-sniff: listening to \"gpib\"\nmpf gpib-sniff: 8 bytes seen, 0 missing\n");
}

TEST_F(GpibSniffToolTest, DecodesAndPrintsJson) {
  const auto decoding = listen({"--decode"});
  const auto json = listen({"--json"});

  talk("a");

  EXPECT_THAT(decoding->line(), ContainsRegex("  T  \"a\", EOI$"));
  EXPECT_THAT(decoding->line(), ContainsRegex("  R  \"a\", EOI$"));
  EXPECT_EQ(nlohmann::json::parse(json->line()).at("direction"), "T");
  EXPECT_EQ(nlohmann::json::parse(json->line()).at("direction"), "R");
}

TEST_F(GpibSniffToolTest, EndsAfterTheGivenTime) {
  const auto ended = runTool({"gpib-sniff", "gpib", "0.1"}, backplane_.name());

  EXPECT_EQ(ended.status, 0);
  EXPECT_EQ(ended.out, "R\ngpibSniff done\n");
}

TEST_F(GpibSniffToolTest, NamesAnAbsentServer) {
  const auto ended = runTool({"gpib-sniff", "nobody", "0.1"}, backplane_.name());

  EXPECT_EQ(ended.status, 1);
  EXPECT_THAT(ended.err, HasSubstr("that it is a GPIB server"));
}

}  // namespace
}  // namespace mpf::test
