// SPDX-License-Identifier: MIT
// Simulation mode of mbbiDirect records. docs/mbbi-direct.md lists all statements of the manual.
#include "tests/epics/epics_fixture.h"
#include "tests/epics/mbbi_direct/scripted_device.h"

namespace mpf::test {
namespace {

class MbbiDirectSimulation : public EpicsTest {
 protected:
  static std::string databaseOf(const std::string& fields) {
    return std::string(ScriptedDevice::kDatabase) + R"(
      record(longin, "mode") {}
      record(longin, "value") {}
      record(mbbiDirect, "d") { field(DTYP, "Scripted") field(SHFT, "4") )" +
           fields + "}";
  }
  // Returns the status of record support.
  static long process() { return Ioc::put("d.PROC", "1"); }
  ScriptedDevice& device_ = ScriptedDevice::install();
};

// "SIML Simulation Mode Location", "SIOL Simulation Value Location", "SVAL Simulation Value": while
// SIML is YES, the value of SIOL is SVAL and VAL, and the device is not read. Base 7 reads 32 bits
// into a signed SVAL.
TEST_F(MbbiDirectSimulation, ReadsTheValueOfSiolInPlaceOfTheDevice) {
  const Ioc ioc(databaseOf(R"(field(SIML, "mode") field(SIOL, "value"))"));
  device_.raw = 0x30;
  ASSERT_EQ(Ioc::put("value", "0x12345"), 0);

  ASSERT_EQ(Ioc::put("mode", "1"), 0);
  EXPECT_EQ(process(), 0);
  EXPECT_EQ(Ioc::get("d.SIMM"), "YES");
  EXPECT_EQ(Ioc::get("d.SVAL"), std::to_string(0x12345));
  EXPECT_EQ(Ioc::get("d"), std::to_string(0x12345)) << "SHFT is not used";
  EXPECT_EQ(Ioc::get("d.B0"), "1");
  EXPECT_EQ(Ioc::get("d.UDF"), "0");
  EXPECT_EQ(device_.reads, 0);

  ASSERT_EQ(Ioc::put("mode", "0"), 0);
  EXPECT_EQ(process(), 0);
  EXPECT_EQ(Ioc::get("d.SIMM"), "NO");
  EXPECT_EQ(Ioc::get("d"), "3");
  EXPECT_EQ(device_.reads, 1);
}

// "SIMS Simulation Mode Alarm Severity"
TEST_F(MbbiDirectSimulation, HasASimmAlarmWithTheSeverityOfSims) {
  const Ioc ioc(databaseOf(R"(field(SIMM, "YES") field(SIOL, "value") field(SIMS, "MINOR"))"));

  EXPECT_EQ(process(), 0);
  EXPECT_EQ(Ioc::get("d.STAT"), "SIMM");
  EXPECT_EQ(Ioc::get("d.SEVR"), "MINOR");

  ASSERT_EQ(Ioc::put("d.SIMS", "NO_ALARM"), 0);
  EXPECT_EQ(process(), 0);
  EXPECT_EQ(Ioc::get("d.SEVR"), "NO_ALARM");
}

// "This routine initializes SIMM with the value of SIML if SIML type is CONSTANT link"
// "SVAL is likewise initialized if SIOL is CONSTANT"
TEST_F(MbbiDirectSimulation, ConstantsAreStoredAtTheStart) {
  const Ioc ioc(databaseOf(R"(field(SIML, "1") field(SIOL, "9"))"));
  EXPECT_EQ(Ioc::get("d.SIMM"), "YES");
  EXPECT_EQ(Ioc::get("d.SVAL"), "9");

  EXPECT_EQ(process(), 0);
  EXPECT_EQ(Ioc::get("d"), "9");
}

// "SIMM Simulation Mode GBLCHOICE ... Modify Yes", "SVAL Simulation Value ... Modify Yes": an
// operator switches the mode and sets the value, where no link does.
TEST_F(MbbiDirectSimulation, SimmAndSvalMayBeWritten) {
  const Ioc ioc(databaseOf(""));
  device_.raw = 0x30;

  ASSERT_EQ(Ioc::put("d.SIMM", "YES"), 0);
  ASSERT_EQ(Ioc::put("d.SVAL", "6"), 0);
  EXPECT_EQ(process(), 0);
  EXPECT_EQ(Ioc::get("d"), "6");

  ASSERT_EQ(Ioc::put("d.SIMM", "NO"), 0);
  EXPECT_EQ(process(), 0);
  EXPECT_EQ(Ioc::get("d"), "3");
}

// The manual has the modes NO and YES. RAW of Base 7 reads SIOL into RVAL, which is converted.
TEST_F(MbbiDirectSimulation, RawModeConvertsTheValueOfSiol) {
  const Ioc ioc(databaseOf(R"(field(SIMM, "RAW") field(SIOL, "value"))"));
  ASSERT_EQ(Ioc::put("value", "0x70"), 0);

  EXPECT_EQ(process(), 0);

  EXPECT_EQ(Ioc::get("d.RVAL"), std::to_string(0x70));
  EXPECT_EQ(Ioc::get("d"), "7");
}

// A mode that does not exist: SOFT, INVALID, and VAL is kept.
TEST_F(MbbiDirectSimulation, AnInvalidModeIsAnAlarm) {
  const Ioc ioc(databaseOf(R"(field(SIML, "mode") field(VAL, "4") field(UDF, "0"))"));
  ASSERT_EQ(Ioc::put("mode", "3"), 0);

  EXPECT_NE(process(), 0);

  EXPECT_EQ(Ioc::get("d.STAT"), "SOFT");
  EXPECT_EQ(Ioc::get("d.SEVR"), "INVALID");
  EXPECT_EQ(Ioc::get("d"), "4");
  EXPECT_EQ(device_.reads, 0);
}

// A link SIOL that fails: LINK, INVALID, and VAL is kept.
TEST_F(MbbiDirectSimulation, AValueThatCannotBeReadIsAnAlarm) {
  const Ioc ioc(databaseOf(R"(field(SIMM, "YES") field(SIOL, "no:such:record")
                              field(VAL, "4") field(UDF, "0"))"));

  EXPECT_NE(process(), 0);

  EXPECT_EQ(Ioc::get("d.STAT"), "LINK");
  EXPECT_EQ(Ioc::get("d.SEVR"), "INVALID");
  EXPECT_EQ(Ioc::get("d"), "4");
}

// SSCN and SDLY of Base 7: how the record is scanned in simulation mode, and how long a simulated
// reading takes.
TEST_F(MbbiDirectSimulation, HasItsOwnScanAndDelay) {
  const Ioc ioc(databaseOf(R"(field(SSCN, ".1 second") field(SDLY, "0") field(SIOL, "value"))"));
  ASSERT_EQ(Ioc::put("value", "11"), 0);

  ASSERT_EQ(Ioc::put("d.SIMM", "YES"), 0);
  EXPECT_EQ(Ioc::get("d.SCAN"), ".1 second");
  Ioc::waitFor("d", "11");

  ASSERT_EQ(Ioc::put("d.SIMM", "NO"), 0);
  EXPECT_EQ(Ioc::get("d.SCAN"), "Passive");
}

}  // namespace
}  // namespace mpf::test
