// SPDX-License-Identifier: MIT
// The tables of fields in the manual of the mbbiDirect record. docs/mbbi-direct.md lists all
// statements of the manual.
#include <dbStaticLib.h>
#include <gmock/gmock.h>
#include <special.h>

#include "tests/epics/epics_fixture.h"
#include "tests/epics/mbbi_direct/scripted_device.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;

class MbbiDirectFields : public EpicsTest {
 protected:
  static std::string databaseOf(const std::string& fields) {
    return std::string(ScriptedDevice::kDatabase) +
           R"(record(calc, "count") { field(CALC, "VAL+1") }
              record(mbbiDirect, "d") { field(DTYP, "Scripted") field(FLNK, "count") )" +
           fields + "}";
  }
  ScriptedDevice& device_ = ScriptedDevice::install();
};

DBADDR addressOf(const std::string& field) {
  DBADDR address{};
  EXPECT_EQ(dbNameToAddr(field.c_str(), &address), 0) << field;
  return address;
}
std::string typeOf(const std::string& field) {
  return pamapdbfType[addressOf(field).pfldDes->field_type].strvalue;
}

// One line of the manual's tables, as Base 7 has it. A comment quotes the manual where it differs.
struct Line {
  const char* name;
  const char* type;
  bool isConfigured;  // DCT: database configuration tools show it
  const char* initial;
  bool isModified;  // clients may write it
  bool processes;  // PP: a write processes a passive record
};
const std::vector<Line> kLines{
    {"VAL", "DBF_LONG", true, "0", true, true},  // "ENUM No"
    {"INP", "DBF_INLINK", true, "", true, false},  // "INLINK Yes 0 No No"
    {"RVAL", "DBF_ULONG", false, "0", true, true},
    {"SHFT", "DBF_USHORT", true, "0", true, false},  // "USHORT No 0 Yes No"
    {"B0", "DBF_UCHAR", false, "0", true, true},  // "UCHAR Yes", as the other bits
    {"B1", "DBF_UCHAR", false, "0", true, true},
    {"B2", "DBF_UCHAR", false, "0", true, true},
    {"B3", "DBF_UCHAR", false, "0", true, true},
    {"B4", "DBF_UCHAR", false, "0", true, true},
    {"B5", "DBF_UCHAR", false, "0", true, true},
    {"B6", "DBF_UCHAR", false, "0", true, true},
    {"B7", "DBF_UCHAR", false, "0", true, true},
    {"B8", "DBF_UCHAR", false, "0", true, true},
    {"B9", "DBF_UCHAR", false, "0", true, true},
    {"BA", "DBF_UCHAR", false, "0", true, true},
    {"BB", "DBF_UCHAR", false, "0", true, true},
    {"BC", "DBF_UCHAR", false, "0", true, true},
    {"BD", "DBF_UCHAR", false, "0", true, true},
    {"BE", "DBF_UCHAR", false, "0", true, true},
    {"BF", "DBF_UCHAR", false, "0", true, true},
    {"NAME", "DBF_STRING", false, "d", false, false},  // "STRING [29] Yes 0"
    {"DESC", "DBF_STRING", true, "", true, false},  // "STRING [29]"
    {"NOBT", "DBF_SHORT", true, "0", false, false},
    {"ORAW", "DBF_ULONG", false, "0", false, false},
    {"MASK", "DBF_ULONG", false, "0", false, false},
    {"MLST", "DBF_LONG", false, "0", false, false},  // "USHORT"
    {"SIOL", "DBF_INLINK", true, "", true, false},  // "INLINK Yes 0 No No"
    {"SVAL", "DBF_LONG", false, "0", true, false},  // "DOUBLE"
    {"SIML", "DBF_INLINK", true, "", true, false},  // "INLINK Yes 0 No No"
    {"SIMM", "DBF_MENU", false, "NO", true, false},  // "GBLCHOICE No 0"
    {"SIMS", "DBF_MENU", true, "NO_ALARM", true, false},  // "GBLCHOICE Yes 0"
};

// "Field Summary Type DCT Initial Access Modify"
TEST_F(MbbiDirectFields, HaveTheirTypesInitialValuesAndRights) {
  const Ioc ioc(databaseOf(""));

  for (const auto& line : kLines) {
    SCOPED_TRACE(line.name);
    const auto field = std::string("d.") + line.name;
    EXPECT_EQ(typeOf(field), line.type);
    EXPECT_EQ(addressOf(field).pfldDes->promptgroup != 0, line.isConfigured);
    EXPECT_EQ(Ioc::get(field), line.initial);
    EXPECT_EQ(Ioc::put(field, Ioc::get(field)), line.isModified ? 0 : S_db_noMod);
  }
}

// "PP"
TEST_F(MbbiDirectFields, ProcessAPassiveRecordWhenTheyAreWritten) {
  const Ioc ioc(databaseOf(""));

  for (const auto& line : kLines) {
    if (!line.isModified) continue;
    SCOPED_TRACE(line.name);
    ASSERT_EQ(Ioc::put("count", "0"), 0);
    const auto before = Ioc::get("count");
    const auto field = std::string("d.") + line.name;
    ASSERT_EQ(Ioc::put(field, Ioc::get(field)), 0);
    EXPECT_EQ(Ioc::get("count") != before, line.processes);
  }
}

// "RVAL Raw Data Value ULONG No 0 Yes Yes": what a client writes is replaced by the device.
TEST_F(MbbiDirectFields, RvalIsReadAgainWhenAClientWritesIt) {
  const Ioc ioc(databaseOf(""));
  device_.raw = 6;

  ASSERT_EQ(Ioc::put("d.RVAL", "9"), 0);

  EXPECT_EQ(Ioc::get("d.RVAL"), "6");
  EXPECT_EQ(Ioc::get("d"), "6");
}

// "SHFT Shift USHORT No 0 Yes No": Base 7 lets clients write it; the next processing uses it.
TEST_F(MbbiDirectFields, ShftMayChangeAtRunTime) {
  const Ioc ioc(databaseOf(""));
  device_.raw = 0x30;

  ASSERT_EQ(Ioc::put("d.SHFT", "4"), 0);
  ASSERT_EQ(Ioc::put("d.PROC", "1"), 0);

  EXPECT_EQ(Ioc::get("d"), "3");
}

// "Each of the fields, B0-BF, represents one bit of the word."
// "set to 1 if a bit is set, and 0 if not": of 32 bits in Base 7, B0 to B1F. The manual's summaries
// omit bit 11, so that "BB" is called "Bit 12" there.
TEST_F(MbbiDirectFields, EachBitFieldIsOneBitOfTheWord) {
  const Ioc ioc(databaseOf(""));
  const std::vector<std::string> names{"B0",  "B1",  "B2",  "B3",  "B4",  "B5",  "B6",  "B7",
                                       "B8",  "B9",  "BA",  "BB",  "BC",  "BD",  "BE",  "BF",
                                       "B10", "B11", "B12", "B13", "B14", "B15", "B16", "B17",
                                       "B18", "B19", "B1A", "B1B", "B1C", "B1D", "B1E", "B1F"};
  ASSERT_EQ(names.size(), 32U);

  for (std::size_t set = 0; set < names.size(); ++set) {
    device_.raw = epicsUInt32{1} << set;
    ASSERT_EQ(Ioc::put("d.PROC", "1"), 0);
    for (std::size_t bit = 0; bit < names.size(); ++bit)
      EXPECT_EQ(Ioc::get("d." + names[bit]), bit == set ? "1" : "0") << names[bit] << " of " << set;
  }
}

// "converts it to an array of sixteen unsigned characters": the bits are adjacent bytes.
TEST_F(MbbiDirectFields, TheBitsAreAnArrayOfUnsignedCharacters) {
  const Ioc ioc(databaseOf(""));

  const auto first = addressOf("d.B0");
  EXPECT_EQ(first.field_size, 1);
  EXPECT_EQ(static_cast<char*>(addressOf("d.BF").pfield) - static_cast<char*>(first.pfield), 15);
  EXPECT_EQ(static_cast<char*>(addressOf("d.B1F").pfield) - static_cast<char*>(first.pfield), 31);
}

// "NAME Record Name STRING [29]": 60 characters in Base 7. "DESC Description STRING [29]": 40.
TEST_F(MbbiDirectFields, NameAndDescHoldMoreCharacters) {
  const std::string name(60, 'n');
  const std::string description(40, 'd');
  const Ioc ioc("record(mbbiDirect, \"" + name + "\") { field(DESC, \"" + description + "\") }");

  EXPECT_EQ(addressOf(name).precord->name, name);
  EXPECT_EQ(addressOf(name).precord->desc, description);
}

// "The LALM field implements the change of state alarm severity", "SDEF is used by record support
// to save time if no states are defined", "No fields exist for the mbbi direct record to have state
// alarms": none of these fields exists in Base 7.
TEST_F(MbbiDirectFields, FieldsOfStatesDoNotExist) {
  const Ioc ioc(databaseOf(""));

  for (const std::string name : {"LALM", "SDEF", "ZRVL", "ZRST", "ZRSV", "UNSV", "COSV"})
    EXPECT_EQ(Ioc::get("d." + name), "no field d." + name);
}

// "This record also has two available soft device support modules--Soft Channel and Raw Soft
// Channel.": Base 7 has a third one.
TEST_F(MbbiDirectFields, DtypSelectsTheDeviceSupport) {
  const Ioc ioc(R"(record(mbbiDirect, "soft") {})");
  ::DBENTRY entry;
  dbInitEntry(pdbbase, &entry);
  ASSERT_EQ(dbFindRecordType(&entry, "mbbiDirect"), 0);

  std::vector<std::string> choices;
  for (auto* node = ellFirst(&entry.precordType->devList); node != nullptr; node = ellNext(node))
    choices.emplace_back(reinterpret_cast<devSup*>(node)->choice);
  dbFinishEntry(&entry);

  EXPECT_EQ(Ioc::get("soft.DTYP"), "Soft Channel");
  EXPECT_THAT(choices,
              ElementsAre("Soft Channel", "Raw Soft Channel", "Async Soft Channel", "MPF"));
}

// get_value: "Fills in the values of struct valueDes so that they refer to VAL."
TEST_F(MbbiDirectFields, TheValueOfTheRecordIsVal) {
  const Ioc ioc(databaseOf(""));

  EXPECT_EQ(addressOf("d").pfield, addressOf("d.VAL").pfield);
  EXPECT_STREQ(addressOf("d").precord->rdes->pvalFldDes->name, "VAL");
}

}  // namespace
}  // namespace mpf::test
