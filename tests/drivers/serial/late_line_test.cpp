// SPDX-License-Identifier: MIT
#include "drivers/serial/late_line.h"

#include <gmock/gmock.h>
#include <stdexcept>

#include "scripted_line.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;

using OpenState = SerialLine::OpenState;

class LateLineTest : public testing::Test {
 protected:
  std::unique_ptr<SerialLine> make() {
    ++makes_;
    if (!missing_.empty()) throw std::runtime_error(missing_);
    return std::make_unique<ScriptedLine>(script_);
  }

  LineScript script_{.problem = "problem of the real line"};
  std::string missing_ = "no module at IP_a";
  int makes_ = 0;
  LateLine line_{"port 3 of UART0", [this] { return make(); }};
};

TEST_F(LateLineTest, IsNotMadeBeforeTheFirstAttemptToOpen) {
  EXPECT_EQ(makes_, 0);
  EXPECT_EQ(line_.description(), "port 3 of UART0");
}

TEST_F(LateLineTest, FailsToOpenAndNamesWhatIsMissing) {
  EXPECT_EQ(line_.tryOpen(), OpenState::failed);
  EXPECT_EQ(line_.problem(), "no module at IP_a");

  missing_ = "another module at IP_a";
  EXPECT_EQ(line_.tryOpen(), OpenState::failed);
  EXPECT_EQ(line_.problem(), "another module at IP_a");
}

TEST_F(LateLineTest, IsAnUnpluggedLineWithoutItsHardware) {
  std::vector<LineByte> bytes;
  const std::vector<std::uint8_t> sent{'a'};
  ASSERT_EQ(line_.tryOpen(), OpenState::failed);

  EXPECT_EQ(line_.waitsFor().fd, -1);
  EXPECT_EQ(line_.openTimeout().count(), 0);
  EXPECT_FALSE(line_.tryRead(bytes));
  EXPECT_EQ(line_.tryWrite(sent), std::nullopt);
  EXPECT_EQ(line_.timeToSend().count(), 0);
  EXPECT_EQ(line_.takeOverruns(), 0U);
  EXPECT_EQ(line_.tryConfigure({.baud = 9600}), "no module at IP_a");
  EXPECT_FALSE(line_.trySetBreak(true));
  line_.discardUnsent();
  line_.close();

  EXPECT_THAT(script_.calls, ElementsAre());
}

TEST_F(LateLineTest, IsMadeOnceWhenTheHardwareIsPresent) {
  ASSERT_EQ(line_.tryOpen(), OpenState::failed);
  missing_.clear();
  script_.open = OpenState::opening;

  EXPECT_EQ(line_.tryOpen(), OpenState::opening);
  script_.open = OpenState::open;
  EXPECT_EQ(line_.tryOpen(), OpenState::open);

  EXPECT_EQ(makes_, 2);
  EXPECT_EQ(line_.problem(), "problem of the real line");
  EXPECT_EQ(line_.description(), "port 3 of UART0");
}

TEST_F(LateLineTest, PassesEachCallToTheRealLine) {
  missing_.clear();
  script_ = {.openTimeout = std::chrono::milliseconds(30),
             .waitsFor = {7, POLLIN, 0},
             .received = "ab",
             .accepts = 1,
             .timeToSend = std::chrono::milliseconds(4),
             .overruns = 5,
             .refusal = "baud 7",
             .canBreak = true};
  std::vector<LineByte> bytes;
  const std::vector<std::uint8_t> sent{'a', 'b'};
  ASSERT_EQ(line_.tryOpen(), OpenState::open);

  EXPECT_EQ(line_.openTimeout().count(), 30);
  EXPECT_EQ(line_.waitsFor().fd, 7);
  EXPECT_TRUE(line_.tryRead(bytes));
  EXPECT_THAT(bytes, ElementsAre(LineByte{'a'}, LineByte{'b'}));
  EXPECT_EQ(line_.tryWrite(sent), 1U);
  EXPECT_EQ(line_.timeToSend().count(), 4);
  EXPECT_EQ(line_.takeOverruns(), 5U);
  EXPECT_EQ(line_.tryConfigure({.baud = 7}), "baud 7");
  EXPECT_TRUE(line_.trySetBreak(true));
  line_.discardUnsent();
  line_.close();
  EXPECT_THAT(script_.calls, ElementsAre("open", "discard", "close"));

  script_.isLost = true;
  EXPECT_FALSE(line_.tryRead(bytes));
  EXPECT_EQ(line_.tryWrite(sent), std::nullopt);
}

}  // namespace
}  // namespace mpf::test
