// SPDX-License-Identifier: MIT
// The events that mbbiDirect records post: "Check to see if monitors should be invoked", and the
// column "Rec Proc Monitor". docs/mbbi-direct.md lists all statements of the manual.
#include <gmock/gmock.h>

#include "tests/epics/epics_fixture.h"
#include "tests/epics/field_monitor.h"
#include "tests/epics/mbbi_direct/scripted_device.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr unsigned kValue = DBE_VALUE | DBE_LOG;
constexpr unsigned kValueAndAlarm = kValue | DBE_ALARM;

// A record without an alarm and with the value 5.
class MbbiDirectMonitors : public EpicsTest {
 protected:
  void process() { ASSERT_EQ(Ioc::put("d.PROC", "1"), 0); }
  void process(epicsUInt32 raw) {
    device_.raw = raw;
    process();
  }
  ScriptedDevice& device_ = ScriptedDevice::install();
  const Ioc ioc_{std::string(ScriptedDevice::kDatabase) + R"(
    record(bo, "simulate") { field(ZNAM, "no") field(ONAM, "yes") }
    record(mbbiDirect, "d") { field(DTYP, "Scripted") field(SHFT, "4")
      field(SIML, "simulate") field(SIOL, "5") field(SVAL, "5") field(SIMS, "MINOR")
      field(SDIS, "0") field(DISS, "MAJOR") field(DISV, "9") }
  )"};
  void SetUp() override { process(0x50); }
};

// "Archive and value change monitors are invoked if MLST is not equal to VAL."
TEST_F(MbbiDirectMonitors, ValIsPostedWhenItHasChanged) {
  FieldMonitor val("d.VAL");

  process(0x50);
  EXPECT_THAT(val.takeMasks(), IsEmpty());
  process(0x5f);
  EXPECT_THAT(val.takeMasks(), IsEmpty()) << "VAL is the shifted value";
  process(0x60);
  EXPECT_THAT(val.takeMasks(), ElementsAre(kValue));
}

// "MLST holds the value when the last monitor for value change was triggered."
TEST_F(MbbiDirectMonitors, MlstIsTheValueThatWasPosted) {
  EXPECT_EQ(Ioc::get("d.MLST"), "5");
  process(0x60);
  EXPECT_EQ(Ioc::get("d.MLST"), "6");
}

// "Monitors for RVAL are checked whenever other monitors are invoked.": Base 7 posts RVAL whenever
// it differs from ORAW, "Old Raw Data", also without a change of VAL.
TEST_F(MbbiDirectMonitors, RvalIsPostedWhenItDiffersFromOraw) {
  FieldMonitor rval("d.RVAL");

  process(0x50);
  EXPECT_THAT(rval.takeMasks(), IsEmpty());
  process(0x5f);
  EXPECT_THAT(rval.takeMasks(), ElementsAre(kValue));
  EXPECT_EQ(Ioc::get("d.ORAW"), std::to_string(0x5f));
}

// "Alarm monitors are invoked if the alarm status or severity has changed."
TEST_F(MbbiDirectMonitors, ValIsPostedWhenTheAlarmHasChanged) {
  FieldMonitor val("d.VAL");
  FieldMonitor severity("d.SEVR");

  ASSERT_EQ(Ioc::put("simulate", "yes"), 0);
  process();
  EXPECT_THAT(val.takeMasks(), ElementsAre(DBE_ALARM));
  EXPECT_THAT(severity.takeMasks(), ElementsAre(DBE_VALUE));

  process();
  EXPECT_THAT(val.takeMasks(), IsEmpty());
  ASSERT_EQ(Ioc::put("simulate", "no"), 0);
  process(0x60);
  EXPECT_THAT(val.takeMasks(), ElementsAre(kValueAndAlarm));
}

// "B0 Bit 0 Value ... Rec Proc Monitor Yes": each bit that has changed.
TEST_F(MbbiDirectMonitors, BitsArePostedWhenTheyHaveChanged) {
  FieldMonitor bit0("d.B0");
  FieldMonitor bit1("d.B1");
  FieldMonitor bit31("d.B1F");

  process(0x60);
  EXPECT_THAT(bit0.takeMasks(), ElementsAre(kValue));
  EXPECT_THAT(bit1.takeMasks(), ElementsAre(kValue));
  EXPECT_THAT(bit31.takeMasks(), IsEmpty());

  process(0x70);
  EXPECT_THAT(bit0.takeMasks(), ElementsAre(kValue));
  EXPECT_THAT(bit1.takeMasks(), IsEmpty());
}

// The manual does not say what happens to the other bits when the alarm changes: Base 7 posts all
// of them, with DBE_ALARM.
TEST_F(MbbiDirectMonitors, AllBitsArePostedWhenTheAlarmHasChanged) {
  FieldMonitor bit0("d.B0");
  FieldMonitor bit31("d.B1F");

  ASSERT_EQ(Ioc::put("simulate", "yes"), 0);
  process();
  EXPECT_THAT(bit0.takeMasks(), ElementsAre(DBE_ALARM));
  EXPECT_THAT(bit31.takeMasks(), ElementsAre(DBE_ALARM));

  ASSERT_EQ(Ioc::put("simulate", "no"), 0);
  process(0x60);
  EXPECT_THAT(bit0.takeMasks(), ElementsAre(kValueAndAlarm));
  EXPECT_THAT(bit31.takeMasks(), ElementsAre(DBE_ALARM));
}

// "Rec Proc Monitor No"
TEST_F(MbbiDirectMonitors, OtherFieldsAreNotPosted) {
  for (const std::string field :
       {"SHFT", "DESC", "NOBT", "ORAW", "MASK", "MLST", "SVAL", "SIMM", "SIMS", "INP"}) {
    SCOPED_TRACE(field);
    FieldMonitor monitor("d." + field);
    process(0x60);
    process(0x50);
    EXPECT_THAT(monitor.takeMasks(), IsEmpty());
  }
}

}  // namespace
}  // namespace mpf::test
