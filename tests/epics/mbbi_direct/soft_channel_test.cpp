// SPDX-License-Identifier: MIT
// mbbiDirect records with "Soft Channel" and "Raw Soft Channel". docs/mbbi-direct.md lists all
// statements of the manual.
#include "tests/epics/epics_fixture.h"

namespace mpf::test {
namespace {

using MbbiDirectSoft = EpicsTest;
using MbbiDirectRawSoft = EpicsTest;

// "Soft Channel reads any unsigned integer directly into VAL." In Base 7 VAL is signed and has 32
// bits: it shows numbers from 2^31 on as negative ones.
TEST_F(MbbiDirectSoft, ReadsAnUnsignedIntegerIntoVal) {
  const Ioc ioc(R"(record(longin, "src") {}
                   record(int64in, "wide") {}
                   record(mbbiDirect, "d") { field(INP, "src") }
                   record(mbbiDirect, "w") { field(INP, "wide") })");
  for (const std::string value : {"0", "1", "65535", "65536", "2147483647"}) {
    ASSERT_EQ(Ioc::put("src", value), 0);
    ASSERT_EQ(Ioc::put("d.PROC", "1"), 0);
    EXPECT_EQ(Ioc::get("d"), value);
    EXPECT_EQ(Ioc::get("d.RVAL"), "0");
  }

  ASSERT_EQ(Ioc::put("wide", "4294967295"), 0);
  ASSERT_EQ(Ioc::put("w.PROC", "1"), 0);
  EXPECT_EQ(Ioc::get("w"), "-1");
  EXPECT_EQ(Ioc::get("w.B1F"), "1");
}

// "read_mbbiDirect always returns a value of 2, which means that no conversion is performed."
TEST_F(MbbiDirectSoft, DoesNotConvert) {
  const Ioc ioc(R"(record(longin, "src") { field(VAL, "48") }
                   record(mbbiDirect, "d") { field(INP, "src") field(NOBT, "2")
                     field(SHFT, "4") })");

  ASSERT_EQ(Ioc::put("d.PROC", "1"), 0);

  EXPECT_EQ(Ioc::get("d"), "48");
  EXPECT_EQ(Ioc::get("d.B4"), "1");
  EXPECT_EQ(Ioc::get("d.RVAL"), "0");
}

// "If INP is a constant, then the VAL is initialized to the INP value"
// "the constant value is stored into VAL by init_record, and UDF is set to FALSE"
TEST_F(MbbiDirectSoft, AConstantIsStoredInValAtTheStart) {
  const Ioc ioc(R"(record(mbbiDirect, "d") { field(INP, "0x8001") }
                   record(mbbiDirect, "none") {})");

  EXPECT_EQ(Ioc::get("d"), "32769");
  EXPECT_EQ(Ioc::get("d.B0"), "1");
  EXPECT_EQ(Ioc::get("d.BF"), "1");
  EXPECT_EQ(Ioc::get("d.UDF"), "0");
  EXPECT_EQ(Ioc::get("none.UDF"), "1") << "there is no constant";
}

// "but can be changed at run-time via dbPutField or dbPutLink"; "VAL can be changed via dbPut
// requests"
TEST_F(MbbiDirectSoft, ValOfAConstantMayBeWritten) {
  const Ioc ioc(R"(record(mbbiDirect, "d") { field(INP, "3") }
                   record(longout, "link") { field(OUT, "d PP") })");

  ASSERT_EQ(Ioc::put("d", "5"), 0);
  EXPECT_EQ(Ioc::get("d"), "5");
  EXPECT_EQ(Ioc::get("d.B0"), "1");
  EXPECT_EQ(Ioc::get("d.B1"), "0");

  ASSERT_EQ(Ioc::put("link", "10"), 0);
  EXPECT_EQ(Ioc::get("d"), "10");
  EXPECT_EQ(Ioc::get("d.B1"), "1");
}

// "B0 Bit 0 Value UCHAR ... Modify Yes": the next processing sets the bits from VAL.
TEST_F(MbbiDirectSoft, ABitThatAClientWritesIsReplaced) {
  const Ioc ioc(R"(record(mbbiDirect, "d") { field(INP, "3") })");

  ASSERT_EQ(Ioc::put("d.B4", "1"), 0);

  EXPECT_EQ(Ioc::get("d"), "3");
  EXPECT_EQ(Ioc::get("d.B4"), "0");
}

// "the INP field can be a constant, a database, or a channel access link"
// "read_mbbiDirect calls recGblGetLinkValue to read the current value of VAL": a link with PP
// processes the other record first. channel_access_test.cpp has the third kind.
TEST_F(MbbiDirectSoft, ADatabaseLinkIsReadWhenTheRecordProcesses) {
  const Ioc ioc(R"(record(calc, "src") { field(CALC, "VAL+1") }
                   record(mbbiDirect, "d") { field(INP, "src PP") })");

  ASSERT_EQ(Ioc::put("d.PROC", "1"), 0);
  EXPECT_EQ(Ioc::get("d"), "1");
  ASSERT_EQ(Ioc::put("d.PROC", "1"), 0);
  EXPECT_EQ(Ioc::get("d"), "2");
}

// "If the return status of recGblGetLinkValue is zero, then read_mbbi sets UDF to FALSE. The status
// of recGblGetLinkValue is returned.": a link that fails keeps VAL; Base 7 sets LINK, INVALID.
TEST_F(MbbiDirectSoft, UdfIsFalseAfterAReadThatSucceeded) {
  const Ioc ioc(R"(record(longin, "src") { field(VAL, "7") field(UDF, "0") }
                   record(mbbiDirect, "good") { field(INP, "src") }
                   record(mbbiDirect, "bad") { field(INP, "no:such:record") })");
  EXPECT_EQ(Ioc::get("good.UDF"), "1");

  ASSERT_EQ(Ioc::put("good.PROC", "1"), 0);
  EXPECT_NE(Ioc::put("bad.PROC", "1"), 0);

  EXPECT_EQ(Ioc::get("good.UDF"), "0");
  EXPECT_EQ(Ioc::get("good.SEVR"), "NO_ALARM");
  EXPECT_EQ(Ioc::get("bad.UDF"), "1");
  EXPECT_EQ(Ioc::get("bad.STAT"), "LINK");
  EXPECT_EQ(Ioc::get("bad.SEVR"), "INVALID");
}

// "Raw Soft Channel reads the value into RVAL, upon which the normal conversion process is
// undergone."
// "values are read into RVAL, VAL is computed from RVAL, and read_mbbiDirect returns a value of 0"
TEST_F(MbbiDirectRawSoft, ConvertsRvalToVal) {
  const Ioc ioc(R"(record(longin, "src") { field(VAL, "0x1234") }
                   record(mbbiDirect, "d") { field(DTYP, "Raw Soft Channel") field(INP, "src")
                     field(SHFT, "4") })");

  ASSERT_EQ(Ioc::put("d.PROC", "1"), 0);

  EXPECT_EQ(Ioc::get("d.RVAL"), std::to_string(0x1230)) << "without NOBT, the bits from SHFT on";
  EXPECT_EQ(Ioc::get("d"), std::to_string(0x123));
  EXPECT_EQ(Ioc::get("d.UDF"), "0");
}

// "If it uses MASK, it should shift it as necessary": Base 7 reads the bits of MASK, shifted by
// SHFT; the manual's Raw Soft Channel reads all bits.
TEST_F(MbbiDirectRawSoft, ReadsTheBitsOfMask) {
  const Ioc ioc(R"(record(longin, "src") { field(VAL, "0x1234") }
                   record(mbbiDirect, "d") { field(DTYP, "Raw Soft Channel") field(INP, "src")
                     field(NOBT, "4") field(SHFT, "8") })");

  ASSERT_EQ(Ioc::put("d.PROC", "1"), 0);

  EXPECT_EQ(Ioc::get("d.MASK"), std::to_string(0xf00));
  EXPECT_EQ(Ioc::get("d.RVAL"), std::to_string(0x200));
  EXPECT_EQ(Ioc::get("d"), "2");
}

// "This module is like the previous except that values are read into RVAL": a constant is stored in
// RVAL at the start, and in VAL when the record processes.
TEST_F(MbbiDirectRawSoft, AConstantIsStoredInRvalAtTheStart) {
  const Ioc ioc(R"(record(mbbiDirect, "d") { field(DTYP, "Raw Soft Channel") field(INP, "0x30")
                     field(SHFT, "4") })");
  EXPECT_EQ(Ioc::get("d.RVAL"), "48");
  EXPECT_EQ(Ioc::get("d"), "0");
  EXPECT_EQ(Ioc::get("d.UDF"), "1");

  ASSERT_EQ(Ioc::put("d.PROC", "1"), 0);

  EXPECT_EQ(Ioc::get("d"), "3");
  EXPECT_EQ(Ioc::get("d.B1"), "1");
  EXPECT_EQ(Ioc::get("d.UDF"), "0");
}

// "RVAL ... Modify Yes": of a constant, which no read replaces.
TEST_F(MbbiDirectRawSoft, RvalOfAConstantMayBeWritten) {
  const Ioc ioc(R"(record(mbbiDirect, "d") { field(DTYP, "Raw Soft Channel") field(SHFT, "4") })");

  ASSERT_EQ(Ioc::put("d.RVAL", "0x50"), 0);

  EXPECT_EQ(Ioc::get("d"), "5");
}

// "The INP link type must be either CONSTANT, DB_LINK, or CA_LINK.": the IOC refuses the address of
// hardware, and the link keeps its old value.
TEST_F(MbbiDirectSoft, TheAddressOfHardwareIsNoInput) {
  const Ioc ioc(R"(record(mbbiDirect, "soft") { field(INP, "4") }
                   record(mbbiDirect, "raw") { field(DTYP, "Raw Soft Channel") field(INP, "4") })");

  for (const std::string record : {"soft", "raw"}) {
    EXPECT_NE(Ioc::put(record + ".INP", "#C0 S1 @card"), 0);
    EXPECT_EQ(Ioc::get(record + ".INP"), "4");
  }
}

// "Note that I/O event scanning is only supported for those card types that interrupt."
TEST_F(MbbiDirectSoft, DoesNotSupportIoEventScanning) {
  const Ioc ioc(R"(record(mbbiDirect, "d") { field(SCAN, "I/O Intr") })");

  EXPECT_EQ(Ioc::get("d.SCAN"), "Passive");
}

}  // namespace
}  // namespace mpf::test
