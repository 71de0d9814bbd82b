// SPDX-License-Identifier: MIT
// "Hideos xx stringParm": records that read or write one text.
#include "tests/epics/devices/string_parm/fake_serial.h"

namespace mpf::test {
namespace {

using StringParmTest = EpicsTest;

TEST_F(StringParmTest, AiSendsItsParametersAndScansTheAnswer) {
  FakeSerial serial(backplane_, "T=12.5\r");
  const Ioc ioc(inputRecord("ai", "Hideos ai stringParm", ",TERM=0d,IX=2,FMT=%lf,N=20,TO=100",
                            "field(PREC, \"1\")"));

  Ioc::waitFor("v.SEVR", "NO_ALARM");

  EXPECT_EQ(Ioc::get("v"), "12.5");
  const auto request = serial.last().fields;
  EXPECT_EQ(request.cmd, serial::cmdRead | serial::cmdSetEom | serial::cmdTimeoutMilliseconds);
  EXPECT_EQ(request.timeout, 100);
  EXPECT_EQ(request.extra, 20);
  EXPECT_EQ(request.eom(), "\r");
}

TEST_F(StringParmTest, AiScansWithItsDescription) {
  FakeSerial serial(backplane_, "T=3\r\n");
  const Ioc ioc(inputRecord("ai", "Hideos ai stringParm", "", "field(DESC, \"T=%lf\")"));

  Ioc::waitFor("v", "3");

  EXPECT_EQ(serial.last().fields.timeout, 1);
  EXPECT_EQ(serial.last().fields.cmd, serial::cmdRead | serial::cmdSetEom);
}

TEST_F(StringParmTest, AnAnswerThatDoesNotMatchMakesTheRecordUndefined) {
  FakeSerial serial(backplane_, "?\r\n");
  const Ioc ioc(inputRecord("longin", "Hideos li stringParm", ",FMT=%d"));

  Ioc::waitFor("v.AMSG", "the answer does not match FMT");

  EXPECT_EQ(Ioc::get("v.STAT"), "UDF");
  EXPECT_EQ(Ioc::get("v.SEVR"), "INVALID");
  EXPECT_EQ(Ioc::get("v.UDF"), "1");
}

TEST_F(StringParmTest, ATimeoutIsNoErrorWithoutTerminator) {
  FakeSerial serial(backplane_, "7", serial::serialServerStatusTimeout);
  const Ioc ioc(inputRecord("longin", "Hideos li stringParm", ",TERM=ok>,FMT=%d"));

  Ioc::waitFor("v.SEVR", "NO_ALARM");

  EXPECT_EQ(Ioc::get("v"), "7");
}

TEST_F(StringParmTest, ATimeoutWithTerminatorEmptiesTheText) {
  FakeSerial serial(backplane_, "7", serial::serialServerStatusTimeout);
  const Ioc ioc(inputRecord("stringin", "Hideos si stringParm", ",TERM=0a", "field(VAL, \"old\")"));

  Ioc::waitFor("v.AMSG", "timeout of the serial line");

  EXPECT_EQ(Ioc::get("v"), "");
  EXPECT_EQ(Ioc::get("v.UDF"), "1");
}

TEST_F(StringParmTest, BiComparesItsStringsBeforeItScans) {
  FakeSerial serial(backplane_, "S on\r\n");
  const Ioc ioc(inputRecord("bi", "Hideos bi stringParm", ",IX=2,0STR=off,1STR=on",
                            "field(ZNAM, \"no\") field(ONAM, \"yes\") field(DESC, \"100 %\")"));

  Ioc::waitFor("v", "yes");

  Ioc::waitFor("v.SEVR", "NO_ALARM");
}

TEST_F(StringParmTest, BiScansANumber) {
  FakeSerial serial(backplane_, "4\r\n");
  const Ioc ioc(inputRecord("bi", "Hideos bi stringParm", "", "field(ONAM, \"yes\")"));

  Ioc::waitFor("v", "yes");
}

TEST_F(StringParmTest, OutputsPrintTheirValueAndAppendTheTerminator) {
  FakeSerial serial(backplane_, "");
  const Ioc ioc(outputRecord("ao", "Hideos ao stringParm", ",TERM=0a,FMT=inst:sel ch1;V %4.3lf",
                             "field(VAL, \"1.5\") field(PREC, \"1\")"));

  serial.waitForText("inst:sel ch1;V 1.500\n");
  EXPECT_EQ(serial.last().fields.cmd, serial::cmdWrite);
  EXPECT_EQ(serial.last().fields.timeout, 3);
  EXPECT_EQ(Ioc::get("v"), "1.5") << "the value of the database is kept";
}

TEST_F(StringParmTest, LongoutPrintsHexadecimal) {
  FakeSerial serial(backplane_, "");
  const Ioc ioc(
      outputRecord("longout", "Hideos lo stringParm", ",FMT=A%02x", "field(VAL, \"10\")"));

  serial.waitForText("A0a\r\n");
}

TEST_F(StringParmTest, StringoutSendsItsTextFromTheIndexOn) {
  FakeSerial serial(backplane_, "");
  const Ioc ioc(outputRecord("stringout", "Hideos so stringParm", " IX=2", "field(VAL, \"abCD\")"));

  serial.waitForText("CD\r\n");
}

TEST_F(StringParmTest, AWriteThatFailsIsAWriteAlarm) {
  FakeSerial serial(backplane_, "", serial::serialServerStatusTimeout);
  const Ioc ioc(outputRecord("stringout", "Hideos so stringParm", "", "field(VAL, \"a\")"));

  Ioc::waitFor("v.STAT", "WRITE");

  EXPECT_EQ(Ioc::get("v.SEVR"), "INVALID");
}

TEST_F(StringParmTest, AFormatThatDoesNotFitDisablesTheRecord) {
  std::string log;
  const auto append = [](void* text, const char* line) {
    static_cast<std::string*>(text)->append(line);
  };
  errlogAddListener(append, &log);
  {
    const Ioc ioc(inputRecord("longin", "Hideos li stringParm", ",FMT=%s"));

    EXPECT_EQ(Ioc::get("v.PACT"), "1");
  }
  errlogFlush();
  errlogRemoveListeners(append, &log);
  EXPECT_NE(log.find("v: INP: format \"%s\": a conversion 's' does not fit"), std::string::npos)
      << log;
}

}  // namespace
}  // namespace mpf::test
