// SPDX-License-Identifier: MIT
// Records that exchange text with a server of Char8Array messages.
#include <fmt/format.h>
#include <mutex>

#include <mpf/serial_commands.h>

#include "tests/epics/epics_fixture.h"

namespace mpf::test {
namespace {

using namespace std::string_literals;

// Answers each request that reads with the same text and status; keeps the requests.
class FakeSerial {
 public:
  struct Request {
    Char8Array fields;
    std::string text;
  };
  FakeSerial(const Backplane& backplane, std::string answer, std::int32_t status = 0)
      : server_(backplane, "a-Serial[0]",
                [this, answer = std::move(answer), status](MessageServer& self, Message&& message) {
                  auto request = *Char8ArrayMessage::tryFrom(std::move(message));
                  keep({*request, {request.value().begin(), request.value().end()}});
                  const bool isRead = (request->cmd & serial::cmdRead) != 0;
                  auto reply =
                      self.allocReplyMessage<Char8Array>(request, isRead ? answer.size() : 0);
                  if (isRead) std::copy(answer.begin(), answer.end(), reply.value().begin());
                  reply->status = status;
                  static_cast<void>(self.reply(std::move(reply)));
                }) {}
  Request last() {
    const std::lock_guard lock(mutex_);
    return last_;
  }
  // A record whose VAL is in the database has no alarm before it processes either.
  void waitForText(const std::string& text) {
    while (last().text != text) std::this_thread::yield();
  }

 private:
  void keep(const Request& request) {
    const std::lock_guard lock(mutex_);
    last_ = request;
  }
  std::mutex mutex_;
  Request last_;
  ThreadServer server_;
};

std::string inputRecord(const char* type, const char* dtyp, const char* parameters,
                        const char* more = "") {
  return fmt::format(
      "record({}, \"v\") {{ field(DTYP, \"{}\") field(INP, \"#C0 S0 @a-Serial[0]{}\") "
      "field(PINI, \"YES\") {} }}\n",
      type, dtyp, parameters, more);
}
std::string outputRecord(const char* type, const char* dtyp, const char* parameters,
                         const char* more = "") {
  return fmt::format(
      "record({}, \"v\") {{ field(DTYP, \"{}\") field(OUT, \"#C0 S0 @a-Serial[0]{}\") "
      "field(PINI, \"YES\") {} }}\n",
      type, dtyp, parameters, more);
}

using StringRecordTest = EpicsTest;

TEST_F(StringRecordTest, AiSendsItsParametersAndScansTheAnswer) {
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

TEST_F(StringRecordTest, AiScansWithItsDescription) {
  FakeSerial serial(backplane_, "T=3\r\n");
  const Ioc ioc(inputRecord("ai", "Hideos ai stringParm", "", "field(DESC, \"T=%lf\")"));

  Ioc::waitFor("v", "3");

  EXPECT_EQ(serial.last().fields.timeout, 1);
  EXPECT_EQ(serial.last().fields.cmd, serial::cmdRead | serial::cmdSetEom);
}

TEST_F(StringRecordTest, AnAnswerThatDoesNotMatchMakesTheRecordUndefined) {
  FakeSerial serial(backplane_, "?\r\n");
  const Ioc ioc(inputRecord("longin", "Hideos li stringParm", ",FMT=%d"));

  Ioc::waitFor("v.AMSG", "the answer does not match FMT");

  EXPECT_EQ(Ioc::get("v.STAT"), "UDF");
  EXPECT_EQ(Ioc::get("v.SEVR"), "INVALID");
  EXPECT_EQ(Ioc::get("v.UDF"), "1");
}

TEST_F(StringRecordTest, ATimeoutIsNoErrorWithoutTerminator) {
  FakeSerial serial(backplane_, "7", serial::serialServerStatusTimeout);
  const Ioc ioc(inputRecord("longin", "Hideos li stringParm", ",TERM=ok>,FMT=%d"));

  Ioc::waitFor("v.SEVR", "NO_ALARM");

  EXPECT_EQ(Ioc::get("v"), "7");
}

TEST_F(StringRecordTest, ATimeoutWithTerminatorEmptiesTheText) {
  FakeSerial serial(backplane_, "7", serial::serialServerStatusTimeout);
  const Ioc ioc(inputRecord("stringin", "Hideos si stringParm", ",TERM=0a", "field(VAL, \"old\")"));

  Ioc::waitFor("v.AMSG", "timeout of the serial line");

  EXPECT_EQ(Ioc::get("v"), "");
  EXPECT_EQ(Ioc::get("v.UDF"), "1");
}

TEST_F(StringRecordTest, BiComparesItsStringsBeforeItScans) {
  FakeSerial serial(backplane_, "S on\r\n");
  const Ioc ioc(inputRecord("bi", "Hideos bi stringParm", ",IX=2,0STR=off,1STR=on",
                            "field(ZNAM, \"no\") field(ONAM, \"yes\") field(DESC, \"100 %\")"));

  Ioc::waitFor("v", "yes");

  Ioc::waitFor("v.SEVR", "NO_ALARM");
}

TEST_F(StringRecordTest, BiScansANumber) {
  FakeSerial serial(backplane_, "4\r\n");
  const Ioc ioc(inputRecord("bi", "Hideos bi stringParm", "", "field(ONAM, \"yes\")"));

  Ioc::waitFor("v", "yes");
}

TEST_F(StringRecordTest, OutputsPrintTheirValueAndAppendTheTerminator) {
  FakeSerial serial(backplane_, "");
  const Ioc ioc(outputRecord("ao", "Hideos ao stringParm", ",TERM=0a,FMT=inst:sel ch1;V %4.3lf",
                             "field(VAL, \"1.5\") field(PREC, \"1\")"));

  serial.waitForText("inst:sel ch1;V 1.500\n");
  EXPECT_EQ(serial.last().fields.cmd, serial::cmdWrite);
  EXPECT_EQ(serial.last().fields.timeout, 3);
  EXPECT_EQ(Ioc::get("v"), "1.5") << "the value of the database is kept";
}

TEST_F(StringRecordTest, LongoutPrintsHexadecimal) {
  FakeSerial serial(backplane_, "");
  const Ioc ioc(
      outputRecord("longout", "Hideos lo stringParm", ",FMT=A%02x", "field(VAL, \"10\")"));

  serial.waitForText("A0a\r\n");
}

TEST_F(StringRecordTest, StringoutSendsItsTextFromTheIndexOn) {
  FakeSerial serial(backplane_, "");
  const Ioc ioc(outputRecord("stringout", "Hideos so stringParm", " IX=2", "field(VAL, \"abCD\")"));

  serial.waitForText("CD\r\n");
}

TEST_F(StringRecordTest, AWriteThatFailsIsAWriteAlarm) {
  FakeSerial serial(backplane_, "", serial::serialServerStatusTimeout);
  const Ioc ioc(outputRecord("stringout", "Hideos so stringParm", "", "field(VAL, \"a\")"));

  Ioc::waitFor("v.STAT", "WRITE");

  EXPECT_EQ(Ioc::get("v.SEVR"), "INVALID");
}

TEST_F(StringRecordTest, AFormatThatDoesNotFitDisablesTheRecord) {
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

TEST_F(StringRecordTest, MpfWriteReadSendsTheFieldOfAnotherRecord) {
  FakeSerial serial(backplane_, "1.0\r\n");
  const Ioc ioc("record(stringout, \"cmd\") { field(VAL, \"*IDN?\\\\r\") }\n" +
                inputRecord("stringin", "MPFwriteRead", ",cmd"));

  Ioc::waitFor("v", "1.0");

  EXPECT_EQ(serial.last().text, "*IDN?\r");
  EXPECT_EQ(serial.last().fields.cmd, serial::cmdWriteRead | serial::cmdFlush);
}

TEST_F(StringRecordTest, LongStringsAreNotCut) {
  const std::string text(100, 'x');
  FakeSerial serial(backplane_, text + "\r\n");
  const Ioc ioc("record(lso, \"cmd\") { field(SIZV, \"200\") }\n" +
                inputRecord("lsi", "MPFwriteRead", ",cmd.VAL$", "field(SIZV, \"200\")"));

  Ioc::waitFor("v.LEN", "101");

  Ioc::waitFor("v.SEVR", "NO_ALARM");
}

TEST_F(StringRecordTest, MpfReadAndMpfWrite) {
  FakeSerial serial(backplane_, "hello\n");
  const Ioc ioc(inputRecord("stringin", "MPFread", "") +
                "record(stringout, \"o\") { field(DTYP, \"MPFwrite\") field(VAL, \"a\\\\t\") "
                "field(OUT, \"#C0 S0 @a-Serial[0]\") }");
  Ioc::waitFor("v", "hello");

  ASSERT_EQ(Ioc::put("o.PROC", "1"), 0);
  serial.waitForText("a\t");
}

}  // namespace
}  // namespace mpf::test
