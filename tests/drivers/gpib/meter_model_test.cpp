// SPDX-License-Identifier: MIT
#include "drivers/gpib/meter_model.h"

#include <gtest/gtest.h>
#include <string>
#include <string_view>

#include <mpf/drivers/gpib/gpib_types.h>

namespace mpf::test {
namespace {

class MeterModelTest : public testing::Test {
 protected:
  void send(std::string_view command) {
    for (std::size_t i = 0; i < command.size(); ++i)
      EXPECT_TRUE(meter_.receive(static_cast<std::uint8_t>(command[i]), i + 1 == command.size()));
  }
  // Up to and including the end of the line; less when the meter has nothing to say.
  std::string read() {
    std::string line;
    while (const auto byte = meter_.nextByte()) {
      line.push_back(static_cast<char>(byte->value));
      sawEnd_ = byte->end;
      if (byte->end || byte->value == '\n') break;
    }
    return line;
  }
  std::string ask(std::string_view question) {
    send(question);
    return read();
  }

  MeterModel meter_;
  bool sawEnd_ = false;
};

TEST_F(MeterModelTest, SendsTheReadingsOfTheManualWithoutAQuestion) {
  EXPECT_EQ(read(), "-8.874270409E-01\r\n");
  EXPECT_EQ(read(), "-9.341735006E-01\r\n");
  EXPECT_EQ(read(), "-9.575970835E-01\r\n");
  EXPECT_EQ(read(), "-1.004537279E+00\r\n");
  EXPECT_TRUE(sawEnd_);
}

TEST(MeterModel, SendsTheVoltageThatItMeasures) {
  MeterModel meter([] { return 2.5; });
  EXPECT_EQ(meter.nextByte()->value, ' ') << "the place of the sign";
  EXPECT_EQ(meter.nextByte()->value, '2');
}

TEST_F(MeterModelTest, AnswersQuestionsInAnyCase) {
  EXPECT_EQ(ask("ID?"), "HP3458A\r\n");
  EXPECT_EQ(ask(" id? \r\n"), "HP3458A\r\n");
  EXPECT_EQ(ask("END OFF;ID?"), "HP3458A\r\n");
}

TEST_F(MeterModelTest, SendsEndOnlyWhenItIsOn) {
  send("END OFF");
  EXPECT_EQ(ask("ID?"), "HP3458A\r\n");
  EXPECT_FALSE(sawEnd_);

  send("end  always\n");

  EXPECT_EQ(ask("ID?"), "HP3458A\r\n");
  EXPECT_TRUE(sawEnd_);
}

TEST_F(MeterModelTest, SendsNothingWithoutATrigger) {
  send("TRIG HOLD");
  EXPECT_EQ(read(), "");

  meter_.trigger();

  EXPECT_EQ(read(), "-8.874270409E-01\r\n");
  EXPECT_EQ(read(), "");
  EXPECT_EQ(ask("TRIG SGL"), "-9.341735006E-01\r\n");
}

TEST_F(MeterModelTest, DiscardsTheRestOfAnAnswerWhenACommandComes) {
  send("TRIG HOLD;ID?");
  EXPECT_EQ(meter_.nextByte()->value, 'H');
  EXPECT_EQ(ask("STB?"), "16\r\n");
}

TEST_F(MeterModelTest, RequestsServiceUntilItIsPolled) {
  send("TRIG HOLD;RQS 128");
  EXPECT_FALSE(meter_.requestsService());

  meter_.trigger();

  EXPECT_TRUE(meter_.requestsService());
  EXPECT_EQ(meter_.serialPoll(),
            kGpibRequestsService | MeterModel::kDataAvailable | MeterModel::kReady);
  EXPECT_FALSE(meter_.requestsService());
  EXPECT_EQ(read(), "-8.874270409E-01\r\n");
  EXPECT_EQ(meter_.serialPoll(), MeterModel::kReady);
}

TEST_F(MeterModelTest, RequestsServiceByCommand) {
  send("RQS 4;SRQ");

  EXPECT_TRUE(meter_.requestsService());
  send("CSB");
  EXPECT_FALSE(meter_.requestsService());
  EXPECT_EQ(meter_.serialPoll(), MeterModel::kReady);
}

TEST_F(MeterModelTest, ReportsCommandsThatItCannotRead) {
  for (const auto* command : {"VOLTS", "END MAYBE", "TRIG", "RQS x", "RQS 256"}) {
    send(command);
    EXPECT_EQ(meter_.serialPoll(), MeterModel::kError | MeterModel::kReady) << command;
    EXPECT_EQ(ask("ERRSTR?"), "104,\"SYNTAX ERROR\"\r\n") << command;
    EXPECT_EQ(ask("ERRSTR?"), "0,\"NO ERROR\"\r\n") << command;
  }
}

TEST_F(MeterModelTest, ShortensCommandsThatAreTooLong) {
  send(std::string(100'000, 'x'));
  EXPECT_EQ(ask("ID?"), "HP3458A\r\n");
}

TEST_F(MeterModelTest, DiscardsEverythingAtAClear) {
  send("TRIG HOLD;RQS 128;TRIG SGL");
  EXPECT_TRUE(meter_.receive('I', false));

  meter_.clear();

  EXPECT_FALSE(meter_.requestsService());
  EXPECT_EQ(read(), "") << "TRIG HOLD lasts";
  send("D?");
  EXPECT_EQ(meter_.serialPoll() & MeterModel::kError, MeterModel::kError);
}

TEST_F(MeterModelTest, ReturnsToItsFirstStateByReset) {
  send("END OFF;TRIG HOLD;RQS 128;RESET");

  EXPECT_EQ(read(), "-8.874270409E-01\r\n");
  EXPECT_TRUE(sawEnd_);
  EXPECT_FALSE(meter_.requestsService());
}

}  // namespace
}  // namespace mpf::test
