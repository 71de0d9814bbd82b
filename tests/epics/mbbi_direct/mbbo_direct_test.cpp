// SPDX-License-Identifier: MIT
// mbboDirect records: soft, in simulation mode, and with the outputs of the digital I/O server.
#include <gmock/gmock.h>

#include "tests/epics/field_monitor.h"
#include "tests/epics/mbbi_direct/digital_io_fixture.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using MbboDirect = EpicsTest;

TEST_F(MbboDirect, ItsBitsAndItsValueAreTheSameWord) {
  const Ioc ioc(R"(record(mbboDirect, "o") { field(VAL, "5") field(UDF, "0") })");
  EXPECT_EQ(Ioc::get("o.B0"), "1");
  EXPECT_EQ(Ioc::get("o.B2"), "1");

  ASSERT_EQ(Ioc::put("o.BF", "1"), 0);
  EXPECT_EQ(Ioc::get("o"), std::to_string(0x8005));
  ASSERT_EQ(Ioc::put("o.B0", "0"), 0);
  EXPECT_EQ(Ioc::get("o"), std::to_string(0x8004));

  ASSERT_EQ(Ioc::put("o", "3"), 0);
  EXPECT_EQ(Ioc::get("o.B0"), "1");
  EXPECT_EQ(Ioc::get("o.B2"), "0");
  EXPECT_EQ(Ioc::get("o.BF"), "0");
}

TEST_F(MbboDirect, HasThirtyTwoBits) {
  const Ioc ioc(R"(record(mbboDirect, "o") { field(UDF, "0") })");

  ASSERT_EQ(Ioc::put("o.B1E", "1"), 0);
  EXPECT_EQ(Ioc::get("o"), std::to_string(1 << 30));
  ASSERT_EQ(Ioc::put("o.B1F", "1"), 0);
  EXPECT_EQ(Ioc::get("o"), std::to_string(static_cast<std::int32_t>(0xc0000000)));
}

// "Soft Channel" writes VAL, "Raw Soft Channel" the shifted bits of MASK.
TEST_F(MbboDirect, SoftChannelsWriteToTheirLinks) {
  const Ioc ioc(R"(
    record(longout, "soft") {}
    record(longout, "raw") {}
    record(mbboDirect, "o") { field(OUT, "soft") field(NOBT, "4") field(SHFT, "4") }
    record(mbboDirect, "r") { field(DTYP, "Raw Soft Channel") field(OUT, "raw") field(NOBT, "4")
      field(SHFT, "4") }
  )");

  ASSERT_EQ(Ioc::put("o", "0x35"), 0);
  ASSERT_EQ(Ioc::put("r", "0x35"), 0);

  EXPECT_EQ(Ioc::get("soft"), std::to_string(0x35));
  EXPECT_EQ(Ioc::get("raw"), std::to_string(0x50));
  EXPECT_EQ(Ioc::get("r.RVAL"), std::to_string(0x350));
}

TEST_F(MbboDirect, AClosedLoopReadsItsInput) {
  const Ioc ioc(R"(
    record(longin, "src") { field(VAL, "6") field(UDF, "0") }
    record(mbboDirect, "o") { field(DOL, "src") field(OMSL, "closed_loop") field(OUT, "dst") }
    record(longout, "dst") {}
  )");

  ASSERT_EQ(Ioc::put("o.PROC", "1"), 0);

  EXPECT_EQ(Ioc::get("dst"), "6");
}

TEST_F(MbboDirect, SimulationModeWritesToSiolInPlaceOfTheDevice) {
  const Ioc ioc(R"(
    record(longout, "dst") {}
    record(longout, "simulated") {}
    record(mbboDirect, "o") { field(OUT, "dst") field(SIML, "1") field(SIOL, "simulated")
      field(SIMS, "MINOR") }
  )");

  ASSERT_EQ(Ioc::put("o", "5"), 0);

  EXPECT_EQ(Ioc::get("simulated"), "5");
  EXPECT_EQ(Ioc::get("dst"), "0");
  EXPECT_EQ(Ioc::get("o.STAT"), "SIMM");
  EXPECT_EQ(Ioc::get("o.SEVR"), "MINOR");
}

TEST_F(MbboDirect, PostsTheValueAndTheBitsThatHaveChanged) {
  const Ioc ioc(R"(record(mbboDirect, "o") { field(VAL, "1") field(UDF, "0") })");
  ASSERT_EQ(Ioc::put("o.PROC", "1"), 0);
  FieldMonitor val("o.VAL");
  FieldMonitor bit0("o.B0");
  FieldMonitor bit1("o.B1");

  ASSERT_EQ(Ioc::put("o", "3"), 0);

  EXPECT_THAT(val.takeMasks(), ElementsAre(DBE_VALUE | DBE_LOG));
  EXPECT_THAT(bit0.takeMasks(), IsEmpty());
  EXPECT_THAT(bit1.takeMasks(), ElementsAre(DBE_VALUE | DBE_LOG));
}

// ---- the digital I/O server. All outputs are ones after power-up.

class MbboDirectDigitalIo : public DigitalIoRecordTest {
 protected:
  static std::string output(const std::string& parameters, const std::string& fields = "") {
    return "record(mbboDirect, \"o\") { field(DTYP, \"MPF\") field(UDF, \"0\") field(OUT, "
           "\"@c-UnidigOut cmd=6 " +
           parameters + "\") " + fields + "}\n";
  }
  static void put(const std::string& field, const std::string& value) {
    ASSERT_EQ(Ioc::put(field, value), 0);
    Ioc::waitFor("o.PACT", "0");
    EXPECT_EQ(Ioc::get("o.SEVR"), "NO_ALARM");
  }
};

TEST_F(MbboDirectDigitalIo, WritesTheBitsOfNobtAndShift) {
  startServers();
  const Ioc ioc(output("address=0xff00 shift=8", "field(NOBT, \"8\")"));
  waitForServer("o");
  EXPECT_EQ(model_->outputs(), 0xff00ffU) << "the other bits keep their values";

  put("o.B1", "1");
  EXPECT_EQ(model_->outputs(), 0xff02ffU);
  EXPECT_EQ(Ioc::get("o"), "2");
  EXPECT_EQ(Ioc::get("o.RVAL"), std::to_string(0x200));

  put("o", "0x81");
  EXPECT_EQ(model_->outputs(), 0xff81ffU);
  put("o", "0x181");  // the bit above NOBT is not written
  EXPECT_EQ(model_->outputs(), 0xff81ffU);
}

TEST_F(MbboDirectDigitalIo, WritesTheBitsOfAMask) {
  startServers();
  const Ioc ioc(output("address=0xffffff mask=0xf00f0 shift=4"));
  waitForServer("o");

  put("o", "0xffff");

  EXPECT_EQ(model_->outputs(), 0xf00f0U);
}

// readback= is the cmd of the request: cmdReadBits, with the same address.
TEST_F(MbboDirectDigitalIo, ReadsItsOutputsBackAtTheFirstConnection) {
  ASSERT_EQ(io_->tryWriteBits(kAll, 0xab5aff), DigitalIoStatus::success);
  startServers();
  const Ioc ioc(output("address=0xff00 shift=8 readback=7", "field(NOBT, \"8\")"));

  Ioc::waitFor("o", std::to_string(0x5a));

  EXPECT_EQ(Ioc::get("o.B1"), "1");
  EXPECT_EQ(Ioc::get("o.B0"), "0");
  EXPECT_EQ(Ioc::get("o.SEVR"), "NO_ALARM");
  put("o.B0", "1");
  EXPECT_EQ(model_->outputs(), 0xab5bffU);
}

TEST_F(MbboDirectDigitalIo, BitsThatTheModuleDoesNotHaveAreAWriteAlarm) {
  startServers();
  const Ioc ioc(output("address=0x1000000"));

  waitForServer("o");

  EXPECT_EQ(Ioc::get("o.STAT"), "WRITE");
  EXPECT_EQ(Ioc::get("o.SEVR"), "INVALID");
  EXPECT_EQ(model_->outputs(), kAll);
}

// The lines of this module are inputs and outputs: an mbbiDirect record follows the mbboDirect.
TEST_F(MbboDirectDigitalIo, AnInputRecordFollowsItsLines) {
  startServers();
  const Ioc ioc(output("address=0xff", "field(NOBT, \"8\")") +
                R"(record(mbbiDirect, "in") { field(DTYP, "MPF") field(SCAN, "I/O Intr")
                  field(INP, "@c-UnidigIn cmd=3 address=0xff") field(NOBT, "8") })");
  waitForServer("o");
  Ioc::waitFor("in", "0");

  for (const std::string value : {"1", "128", "255", "85"}) {
    put("o", value);
    Ioc::waitFor("in", value);
  }
}

}  // namespace
}  // namespace mpf::test
