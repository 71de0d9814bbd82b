// SPDX-License-Identifier: MIT
// "GPIB (NI or HIDEOS)": records with GPIB links, and the messages that they send.
#include <iocsh.h>

#include <mpf/gpib_commands.h>

#include "epics/gpib_links.h"
#include "tests/epics/devices/string_parm/fake_serial.h"

namespace mpf::test {
namespace {

constexpr const char* kDtyp = "field(DTYP, \"GPIB (NI or HIDEOS)\")";

class GpibRecordTest : public EpicsTest {
 protected:
  GpibRecordTest() { GpibLinks::instance().add(10, {0, "a-Serial[0]"}); }
  // A record "v" that processes at the start of the IOC.
  static std::string input(const char* type, const char* link, const char* more = "") {
    return fmt::format("record({}, \"v\") {{ {} field(INP, \"{}\") field(PINI, \"YES\") {} }}\n",
                       type, kDtyp, link, more);
  }
  static std::string output(const char* type, const char* link, const char* value) {
    return fmt::format(
        "record({}, \"v\") {{ {} field(OUT, \"{}\") field(PINI, \"YES\") field(VAL, \"{}\") }}\n",
        type, kDtyp, link, value);
  }
};

TEST_F(GpibRecordTest, AnInputAsksTheInstrumentAtItsAddress) {
  FakeSerial server(backplane_, "-8.874270409E-01\r\n");
  const Ioc ioc(input("ai", "#L10 A22 @?V\\\\n", "field(PREC, \"6\")"));

  Ioc::waitFor("v", "-0.887427");

  EXPECT_EQ(server.last().text, "?V\n");
  EXPECT_EQ(server.last().fields.cmd, gpib::cmdWriteRead);
  EXPECT_EQ(server.last().fields.address, 22);
  EXPECT_EQ(Ioc::get("v.SEVR"), "NO_ALARM");
}

TEST_F(GpibRecordTest, AnInputWithoutAQuestionOnlyReads) {
  FakeSerial server(backplane_, "hello");
  const Ioc ioc(input("stringin", "#L10 A2205 @"));

  Ioc::waitFor("v", "hello");

  EXPECT_EQ(server.last().fields.cmd, gpib::cmdRead);
  EXPECT_EQ(server.last().fields.address, 2205) << "primary address 22, secondary address 5";
}

TEST_F(GpibRecordTest, ALonginReadsTheFirstNumber) {
  FakeSerial server(backplane_, "ERR -221,\"Settings conflict\"");
  const Ioc ioc(input("longin", "#L10 A1 @ERR?"));

  Ioc::waitFor("v", "-221");
}

TEST_F(GpibRecordTest, TheFirstNumberMayFollowADashOrAPoint) {
  const FakeSerial server(backplane_, "DC-V. 1.5");
  const Ioc ioc(input("ai", "#L10 A1 @?", "field(PREC, \"1\")") +
                fmt::format("record(longin, \"n\") {{ {} field(INP, \"#L10 A1 @?\") "
                            "field(PINI, \"YES\") }}",
                            kDtyp));

  Ioc::waitFor("v", "1.5");
  Ioc::waitFor("n", "2");  // rounded
}

TEST_F(GpibRecordTest, ALonginRoundsTheNumber) {
  const FakeSerial server(backplane_, "-8.874270409E-01\r\n");
  const Ioc ioc(input("longin", "#L10 A1 @?"));

  Ioc::waitFor("v", "-1");
}

TEST_F(GpibRecordTest, ANumberThatDoesNotFitIsAnAlarmAndTheFieldKeepsItsValue) {
  for (const std::string type : {"ai", "longin"}) {
    SCOPED_TRACE(type);
    const FakeSerial server(backplane_, type == "ai" ? "1e999" : "3000000000");
    const Ioc ioc(input(type.c_str(), "#L10 A1 @?", "field(VAL, \"7\")"));

    Ioc::waitFor("v.AMSG", "the value does not fit the record");

    EXPECT_EQ(Ioc::get("v"), "7");
    EXPECT_EQ(Ioc::get("v.SEVR"), "INVALID");
  }
}

TEST_F(GpibRecordTest, AnAddressThatCannotExistIsRefused) {
  for (const char* link : {"#L10 A31 @?", "#L10 A-5 @?", "#L10 A2231 @?", "#L10 A3100 @?"}) {
    SCOPED_TRACE(link);
    const Ioc ioc(input("ai", link));
    EXPECT_EQ(Ioc::get("v.PACT"), "1");
    EXPECT_EQ(Ioc::get("v.STAT"), "LINK");
  }
}

TEST_F(GpibRecordTest, ALongAnswerIsNotCut) {
  FakeSerial server(backplane_, std::string(100, 'x'));
  const Ioc ioc(input("lsi", "#L10 A1 @LONG?", "field(SIZV, \"200\")"));

  Ioc::waitFor("v.LEN", "101");
}

TEST_F(GpibRecordTest, OutputsPrintTheirValue) {
  FakeSerial server(backplane_, "");
  {
    const Ioc ioc(output("ao", "#L10 A9 @VOLT %.2f\\\\n", "1.5"));
    server.waitForText("VOLT 1.50\n");
    EXPECT_EQ(server.last().fields.cmd, gpib::cmdWrite);
    EXPECT_EQ(server.last().fields.address, 9);
  }
  {
    const Ioc ioc(output("longout", "#L10 A9 @", "-7"));
    server.waitForText("-7");
  }
  {
    const Ioc ioc(output("stringout", "#L10 A9 @DISP %s\\\\n", "C:\\\\new"));
    server.waitForText("DISP C:\\new\n");  // the value is sent as it is
  }
  const Ioc ioc(fmt::format(
      "record(lso, \"v\") {{ {} field(OUT, \"#L10 A9 @\") field(SIZV, \"80\") }}", kDtyp));
  ASSERT_EQ(Ioc::put("v", "*RST"), 0);
  Ioc::put("v.PROC", "1");
  server.waitForText("*RST");
}

TEST_F(GpibRecordTest, AFailureIsAnAlarmWithItsReason) {
  const FakeSerial server(backplane_, "", gpib::gpibStatusNoListener);
  const Ioc ioc(input("ai", "#L10 A3 @?V"));

  Ioc::waitFor("v.AMSG", "no GPIB instrument at this address");

  EXPECT_EQ(Ioc::get("v.SEVR"), "INVALID");
  EXPECT_EQ(Ioc::get("v.STAT"), "READ");
}

TEST_F(GpibRecordTest, AnAnswerWithoutANumberIsAnAlarm) {
  const FakeSerial server(backplane_, "overload");
  const Ioc ioc(input("ai", "#L10 A3 @?V"));

  Ioc::waitFor("v.AMSG", "the answer has no number");
}

TEST_F(GpibRecordTest, EachLinkHasItsServer) {
  const FakeSerial one(backplane_, "1");
  const ThreadServer two(backplane_, "GPIB1", [](MessageServer& self, Message&& message) {
    const auto request = *Char8ArrayMessage::tryFrom(std::move(message));
    auto reply = self.allocReplyMessage<Char8Array>(request, 1);
    reply.value()[0] = '2';
    static_cast<void>(self.reply(std::move(reply)));
  });
  GpibLinks::instance().add(11, {0, "GPIB1"});
  const Ioc ioc(input("ai", "#L10 A3 @?V") +
                fmt::format("record(ai, \"w\") {{ {} field(INP, \"#L11 A3 @?V\") "
                            "field(PINI, \"YES\") }}",
                            kDtyp));

  Ioc::waitFor("v", "1");
  Ioc::waitFor("w", "2");
}

TEST_F(GpibRecordTest, ACommandOfTheShellConfiguresALink) {
  const Ioc ioc("");  // registers the commands

  EXPECT_EQ(iocshCmd("HiDEOSGpibLinkConfig(12, 3, \"GPIB2\")"), 0);

  EXPECT_EQ(GpibLinks::instance().find(12), (GpibLink{3, "GPIB2"}));
  EXPECT_NE(iocshCmd("HiDEOSGpibLinkConfig(12, 4, \"GPIB2\")"), 0) << "it has a server already";
}

TEST_F(GpibRecordTest, ARecordOfALinkWithoutServerIsRefused) {
  const Ioc ioc(input("ai", "#L77 A3 @?V"));

  EXPECT_EQ(Ioc::get("v.PACT"), "1");
}

// AddressSanitizer sees it if the end of the next IOC uses the record.
TEST_F(GpibRecordTest, ARefusedRecordLeavesNothingToTheNextIoc) {
  {
    const Ioc refused(input("ai", "#L77 A3 @?V"));
  }
  FakeSerial server(backplane_, "-8.874270409E-01\r\n");

  const Ioc next(input("ai", "#L10 A22 @?V\\\\n"));

  Ioc::waitFor("v.UDF", "0");
}

TEST_F(GpibRecordTest, AnInvalidFormatIsRefused) {
  {
    const Ioc ioc(output("ao", "#L10 A9 @VOLT %s", "1.5"));
    EXPECT_EQ(Ioc::get("v.PACT"), "1");
  }
  const Ioc ioc(output("stringout", "#L10 A9 @DISP", "a"));
  EXPECT_EQ(Ioc::get("v.PACT"), "1");
}

}  // namespace
}  // namespace mpf::test
