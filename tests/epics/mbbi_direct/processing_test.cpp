// SPDX-License-Identifier: MIT
// Record support of mbbiDirect and its device support: "Record Support Routines", "Record
// Processing", "Device Support". docs/mbbi-direct.md lists all statements of the manual.
#include <dbTest.h>
#include <epicsStdio.h>
#include <gmock/gmock.h>

#include "tests/epics/epics_fixture.h"
#include "tests/epics/mbbi_direct/error_log.h"
#include "tests/epics/mbbi_direct/scripted_device.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class MbbiDirectProcessing : public EpicsTest {
 protected:
  static std::string databaseOf(const std::string& records) {
    return ScriptedDevice::kDatabase + records;
  }
  static std::string recordOf(const std::string& fields) {
    return databaseOf("record(mbbiDirect, \"d\") { field(DTYP, \"Scripted\") " + fields + "}");
  }
  // Returns the status of record support.
  static long process(const std::string& name) {
    auto* record = testdbRecordPtr(name.c_str());
    dbScanLock(record);
    const auto status = dbProcess(record);
    dbScanUnlock(record);
    return status;
  }
  ScriptedDevice& device_ = ScriptedDevice::install();
};

// ---- init_record

// "checks to see that device support is available and a device support read routine is defined. If
// either does not exist, an error message is issued and processing is terminated."
// process: "an error message is issued and processing is terminated with the PACT field still set
// to TRUE. This ensures that processes will no longer be called for this record. Thus error storms
// will not occur."
TEST_F(MbbiDirectProcessing, EndsWithoutDeviceSupportOrItsReadRoutine) {
  for (const std::string type : {"Without table", "Without read"}) {
    SCOPED_TRACE(type);
    ScriptedDevice::install();
    ErrorLog log;
    const Ioc ioc(databaseOf("record(mbbiDirect, \"d\") { field(DTYP, \"" + type + "\") }"));
    EXPECT_THAT(log.text(), HasSubstr("mbbiDirect: init_record"));

    EXPECT_NE(process("d"), 0);
    EXPECT_THAT(log.text(), HasSubstr("read_mbbi"));
    EXPECT_EQ(Ioc::get("d.PACT"), "1");

    const auto logged = log.text();
    for (int again = 0; again < 3; ++again) process("d");
    EXPECT_EQ(log.text(), logged);
  }
}

// "Clears MASK and then sets the NOBT low order bits."
// "Record support sets low order NOBT bits in MASK. Device support can shift this value."
// "NOBT Number of hardware bits accessed. They must be consecutive."
TEST_F(MbbiDirectProcessing, MaskHasTheLowOrderNobtBits) {
  for (const auto& [nobt, mask] : std::vector<std::pair<int, epicsUInt32>>{
           {0, 0}, {1, 1}, {5, 0x1f}, {16, 0xffff}, {32, ~0U}}) {
    ScriptedDevice::install();
    const Ioc ioc(recordOf("field(NOBT, \"" + std::to_string(nobt) + "\")"));
    EXPECT_EQ(device_.maskAtInit, mask);
    EXPECT_EQ(Ioc::get("d.MASK"), std::to_string(mask));
  }
}

// "Clears MASK": Base 7 keeps a MASK of the database, and ignores NOBT then.
TEST_F(MbbiDirectProcessing, AMaskOfTheDatabaseIsKept) {
  const Ioc ioc(recordOf(R"(field(MASK, "0xa0") field(NOBT, "4"))"));

  EXPECT_EQ(Ioc::get("d.MASK"), std::to_string(0xa0));
}

// "If device support includes init_record, it is called."
// "SHFT This can be set by the device support module at init_record time."
// "refresh_bits is then called to refresh all the bit fields based on a hardware value": Base 7
// sets them from VAL, which the device may have set.
TEST_F(MbbiDirectProcessing, InitRecordOfTheDeviceIsCalled) {
  device_.shift = 4;
  const Ioc ioc(recordOf(R"(field(VAL, "5"))"));

  EXPECT_EQ(device_.recordInits, 1);
  EXPECT_EQ(Ioc::get("d.SHFT"), "4");
  EXPECT_EQ(Ioc::get("d.B0"), "1");
  EXPECT_EQ(Ioc::get("d.B1"), "0");
  EXPECT_EQ(Ioc::get("d.B2"), "1");
}

// init_record of device support: "This routine is optional.": without it, Base 7 does not set the
// bits until the record processes.
TEST_F(MbbiDirectProcessing, InitRecordOfTheDeviceIsOptional) {
  device_.raw = 6;
  const Ioc ioc(databaseOf(
      R"(record(mbbiDirect, "d") { field(DTYP, "Without init_record") field(VAL, "5") })"));
  EXPECT_EQ(Ioc::get("d.B0"), "0");

  EXPECT_EQ(process("d"), 0);

  EXPECT_EQ(Ioc::get("d"), "6");
  EXPECT_EQ(Ioc::get("d.B1"), "1");
}

// ---- process

// "Set rval = RVAL", "Shift rval right SHFT bits", "Set VAL = RVAL": VAL is the shifted number, and
// RVAL keeps all bits.
// "It is the responsibility of the device support routine to give this field [RVAL] a value."
TEST_F(MbbiDirectProcessing, Status0ComputesValFromRval) {
  const Ioc ioc(recordOf(R"(field(SHFT, "4"))"));
  device_.raw = 0x12345;

  EXPECT_EQ(process("d"), 0);

  EXPECT_EQ(Ioc::get("d.RVAL"), std::to_string(0x12345));
  EXPECT_EQ(Ioc::get("d"), std::to_string(0x1234));
  EXPECT_EQ(Ioc::get("d.UDF"), "0");
}

// "If status is 2, set status = 0"; "2: Success, but don't modify VAL."
// "VAL ... is set by the device support routines if they don't want record support to set it."
TEST_F(MbbiDirectProcessing, Status2KeepsVal) {
  const Ioc ioc(recordOf(R"(field(VAL, "9") field(UDF, "0"))"));
  device_.raw = 6;
  device_.status = 2;

  EXPECT_EQ(process("d"), 0);

  EXPECT_EQ(Ioc::get("d"), "9");
  EXPECT_EQ(Ioc::get("d.RVAL"), "6");
}

// "If status is 1, return(0)", "Other: Error.": Base 7 treats 1 as the other errors: VAL is kept,
// the record completes, and the status is returned. It sets no alarm of its own.
TEST_F(MbbiDirectProcessing, AnotherStatusKeepsValAndIsReturned) {
  const Ioc ioc(recordOf(R"(field(VAL, "9") field(UDF, "0"))"));
  device_.raw = 6;
  for (const long status : {1L, -1L}) {
    device_.status = status;

    EXPECT_EQ(process("d"), status);

    EXPECT_EQ(Ioc::get("d"), "9");
    EXPECT_EQ(Ioc::get("d.PACT"), "0");
    EXPECT_EQ(Ioc::get("d.SEVR"), "NO_ALARM");
  }
}

// "If PACT has been changed to TRUE, the device support read routine has started but has not
// completed reading a new input value. In this case, the processing routine merely returns, leaving
// PACT TRUE."
// "The possible alarm conditions ... are the SCAN and READ alarms.": SCAN, of a record that is
// processed while it is active. "they are always of MAJOR severity": INVALID in Base 7.
TEST_F(MbbiDirectProcessing, AnActiveRecordHasAScanAlarmAfterTenTrials) {
  const Ioc ioc(recordOf(""));
  process("d");
  device_.isSlow = true;
  device_.raw = 5;
  EXPECT_EQ(process("d"), 0);
  EXPECT_EQ(Ioc::get("d.PACT"), "1");
  EXPECT_EQ(Ioc::get("d"), "0") << "the rest of the processing has not run";

  constexpr int kTrials = 10;
  for (int trial = 0; trial < kTrials; ++trial) process("d");
  EXPECT_EQ(Ioc::get("d.STAT"), "NO_ALARM");
  process("d");

  EXPECT_EQ(Ioc::get("d.STAT"), "SCAN");
  EXPECT_EQ(Ioc::get("d.SEVR"), "INVALID");
  EXPECT_EQ(device_.reads, 2);
}

// "PACT = TRUE"; "Scan forward link if necessary, set PACT FALSE, and return.": the linked record
// still finds PACT TRUE.
TEST_F(MbbiDirectProcessing, TheForwardLinkIsScannedBeforePactIsFalse) {
  const Ioc ioc(databaseOf(R"(
    record(mbbiDirect, "d") { field(DTYP, "Scripted") field(FLNK, "pact") }
    record(longin, "pact") { field(INP, "d.PACT") }
  )"));

  process("d");

  EXPECT_EQ(Ioc::get("pact"), "1");
  EXPECT_EQ(Ioc::get("d.PACT"), "0");
}

// "TIME = tsLocalTime": Base 7 takes the time that TSE and TSEL name.
TEST_F(MbbiDirectProcessing, TimeIsThatOfTheProcessing) {
  const Ioc ioc(databaseOf(R"(
    record(mbbiDirect, "now") { field(DTYP, "Scripted") }
    record(mbbiDirect, "later") { field(DTYP, "Scripted") field(TSEL, "now.TIME") }
  )"));
  const auto& time = testdbRecordPtr("now")->time;
  EXPECT_EQ(time.secPastEpoch, 0U);

  process("now");
  process("later");

  EXPECT_GT(time.secPastEpoch, 0U);
  EXPECT_TRUE(epicsTimeEqual(&testdbRecordPtr("later")->time, &time));
}

// "NSEV and NSTA are reset to 0."
TEST_F(MbbiDirectProcessing, NewAlarmsAreResetAfterProcessing) {
  const Ioc ioc(recordOf(""));
  device_.status = -1;

  process("d");

  EXPECT_EQ(Ioc::get("d.STAT"), "UDF");
  EXPECT_EQ(Ioc::get("d.SEVR"), "INVALID");
  EXPECT_EQ(Ioc::get("d.NSTA"), "NO_ALARM");
  EXPECT_EQ(Ioc::get("d.NSEV"), "NO_ALARM");
}

// "The mbbiDirect record has the standard fields for specifying under what circumstances the record
// will be processed."
TEST_F(MbbiDirectProcessing, HasTheStandardScanFields) {
  const Ioc ioc(databaseOf(R"(
    record(mbbiDirect, "start") { field(DTYP, "Scripted") field(PINI, "YES") }
    record(mbbiDirect, "periodic") { field(DTYP, "Scripted") field(SCAN, ".1 second") }
    record(mbbiDirect, "event") { field(DTYP, "Scripted") field(SCAN, "Event") field(EVNT, "7") }
    record(mbbiDirect, "never") { field(DTYP, "Scripted") field(DISV, "0") }
  )"));

  Ioc::waitFor("start.UDF", "0");
  Ioc::waitFor("periodic.UDF", "0");
  EXPECT_EQ(Ioc::get("event.UDF"), "1");
  postEvent(eventNameToHandle("7"));
  Ioc::waitFor("event.UDF", "0");
  process("never");
  EXPECT_EQ(Ioc::get("never.STAT"), "DISABLE");
  EXPECT_EQ(Ioc::get("never.UDF"), "1");
}

// ---- device support routines

// report: "Not currently used.": dbior calls it in Base 7.
// init: "This routine is called once during IOC initialization.": twice in Base 7, before and after
// the records are initialised.
TEST_F(MbbiDirectProcessing, ReportAndInitOfTheDeviceAreCalled) {
  const Ioc ioc(recordOf(""));

  EXPECT_THAT(device_.inits, ElementsAre(0, 1));
  EXPECT_EQ(device_.reports, 0);

  auto* const nowhere = std::fopen("/dev/null", "w");
  epicsSetThreadStdout(nowhere);
  dbior(nullptr, 0);
  epicsSetThreadStdout(nullptr);
  std::fclose(nowhere);
  EXPECT_GT(device_.reports, 0);
}

// get_ioint_info: "This routine is called by the ioEventScan system each time the record is added
// or deleted from an I/O event scan list. cmd has the value (0,1) if the record is being (added to,
// deleted from) an I/O event list."
TEST_F(MbbiDirectProcessing, IoEventScanningAsksTheDevice) {
  const Ioc ioc(recordOf(R"(field(SCAN, "I/O Intr"))"));
  EXPECT_THAT(device_.interrupts, ElementsAre(0));
  device_.raw = 3;

  scanIoRequest(device_.scan);
  Ioc::waitFor("d", "3");

  ASSERT_EQ(Ioc::put("d.SCAN", "Passive"), 0);
  EXPECT_THAT(device_.interrupts, ElementsAre(0, 1));
}

// get_ioint_info: "It must be provided for any device type that can use the ioEvent scanner."
TEST_F(MbbiDirectProcessing, IoEventScanningNeedsGetIoIntInfo) {
  const Ioc ioc(databaseOf(R"(record(mbbiDirect, "d") {
    field(DTYP, "Without init_record") field(SCAN, "I/O Intr") })"));

  EXPECT_EQ(Ioc::get("d.SCAN"), "Passive");
}

}  // namespace
}  // namespace mpf::test
