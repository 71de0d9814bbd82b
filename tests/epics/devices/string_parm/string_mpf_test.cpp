// SPDX-License-Identifier: MIT
// "MPFwriteRead", "MPFread" and "MPFwrite": records that exchange plain text.
#include "tests/epics/devices/string_parm/fake_serial.h"

namespace mpf::test {
namespace {

using StringMpfTest = EpicsTest;

TEST_F(StringMpfTest, MpfWriteReadSendsTheFieldOfAnotherRecord) {
  FakeSerial serial(backplane_, "1.0\r\n");
  const Ioc ioc("record(stringout, \"cmd\") { field(VAL, \"*IDN?\\\\r\") }\n" +
                inputRecord("stringin", "MPFwriteRead", ",cmd"));

  Ioc::waitFor("v", "1.0");

  EXPECT_EQ(serial.last().text, "*IDN?\r");
  EXPECT_EQ(serial.last().fields.cmd, serial::cmdWriteRead | serial::cmdFlush);
}

TEST_F(StringMpfTest, LongStringsAreNotCut) {
  const std::string text(100, 'x');
  FakeSerial serial(backplane_, text + "\r\n");
  const Ioc ioc("record(lso, \"cmd\") { field(SIZV, \"200\") }\n" +
                inputRecord("lsi", "MPFwriteRead", ",cmd.VAL$", "field(SIZV, \"200\")"));

  Ioc::waitFor("v.LEN", "101");

  Ioc::waitFor("v.SEVR", "NO_ALARM");
}

TEST_F(StringMpfTest, MpfReadAndMpfWrite) {
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
