// SPDX-License-Identifier: MIT
// mbbiDirect records that read the digital I/O server, polled and with SCAN "I/O Intr".
// docs/mbbi-direct.md lists all statements of the manual.
#include "tests/epics/mbbi_direct/digital_io_fixture.h"

namespace mpf::test {
namespace {

class MbbiDirectDigitalIo : public DigitalIoRecordTest {
 protected:
  static std::string polled(const std::string& parameters, const std::string& fields = "") {
    return recordOf("polled", "cmd=7 " + parameters, fields);
  }
  static std::string monitored(const std::string& parameters, const std::string& fields = "") {
    return recordOf("monitored", "cmd=3 " + parameters, "field(SCAN, \"I/O Intr\")" + fields);
  }

 private:
  static std::string recordOf(const std::string& name, const std::string& parameters,
                              const std::string& fields) {
    return "record(mbbiDirect, \"" + name + "\") { field(DTYP, \"MPF\") field(INP, \"@c-UnidigIn " +
           parameters + "\") " + fields + "}\n";
  }
};

// "The mbbiDirect record retrieves a sixteen-bit hardware value"
// "MASK is used by device support routine to read hardware register."
// "The device support routine should perform the shift in init_record.", "and also give SHFT a
// value": shift= of the link.
TEST_F(MbbiDirectDigitalIo, ReadsTheBitsOfNobtAndShift) {
  startServers();
  model_->setInputs(kAll, 0xabcdef);
  const Ioc ioc(polled("address=0xff00 shift=8", "field(NOBT, \"8\")"));

  waitForServer("polled");

  EXPECT_EQ(Ioc::get("polled.SHFT"), "8");
  EXPECT_EQ(Ioc::get("polled.MASK"), std::to_string(0xff00));
  EXPECT_EQ(Ioc::get("polled.RVAL"), std::to_string(0xcd00));
  EXPECT_EQ(Ioc::get("polled"), std::to_string(0xcd));
  EXPECT_EQ(Ioc::get("polled.B0"), "1");
  EXPECT_EQ(Ioc::get("polled.B1"), "0");
  EXPECT_EQ(Ioc::get("polled.SEVR"), "NO_ALARM");
}

// "NOBT Number of hardware bits accessed. They must be consecutive.": mask= selects any bits.
TEST_F(MbbiDirectDigitalIo, ReadsTheBitsOfAMask) {
  startServers();
  model_->setInputs(kAll, 0xabcdef);
  const Ioc ioc(polled("address=-1 mask=0xf00f0 shift=4"));

  waitForServer("polled");

  EXPECT_EQ(Ioc::get("polled.MASK"), std::to_string(0xf00f0));
  EXPECT_EQ(Ioc::get("polled"), std::to_string(0xb00e));
}

// MASK of the database, without mask= in the link: as with "Raw Soft Channel", from bit SHFT on.
TEST_F(MbbiDirectDigitalIo, ReadsTheBitsOfMaskOfTheDatabase) {
  startServers();
  model_->setInputs(kAll, 0xabcdef);
  const Ioc ioc(polled("address=-1 shift=4", "field(MASK, \"0xf0f\")"));

  waitForServer("polled");

  EXPECT_EQ(Ioc::get("polled.MASK"), std::to_string(0xf0f0));
  EXPECT_EQ(Ioc::get("polled"), std::to_string(0xc0e));
}

// SHFT of the database, without shift= in the link; address= is the server's own mask.
TEST_F(MbbiDirectDigitalIo, ReadsTheBitsOfShftOfTheDatabase) {
  startServers();
  model_->setInputs(kAll, 0xabcdef);
  const Ioc ioc(polled("address=0x0f0000", "field(NOBT, \"8\") field(SHFT, \"16\")"));

  waitForServer("polled");

  EXPECT_EQ(Ioc::get("polled"), std::to_string(0xb));
}

// Without NOBT, mask= and shift=, all bits of the server.
TEST_F(MbbiDirectDigitalIo, ReadsAllBits) {
  startServers();
  model_->setInputs(kAll, 0xabcdef);
  const Ioc ioc(polled("address=-1"));

  waitForServer("polled");

  EXPECT_EQ(Ioc::get("polled"), std::to_string(0xabcdef));
  EXPECT_EQ(Ioc::get("polled.B17"), "1");
}

// "sixteen-bit hardware value": cmdReadBits16 moves the bits in the server.
TEST_F(MbbiDirectDigitalIo, ReadsSixteenBitsFromAnyBitOn) {
  startServers();
  model_->setInputs(kAll, 0xabcdef);
  const Ioc ioc(R"(record(mbbiDirect, "polled") { field(DTYP, "MPF") field(NOBT, "16")
    field(INP, "@c-UnidigIn cmd=8 address=0xffff extra=4") })");

  waitForServer("polled");

  EXPECT_EQ(Ioc::get("polled"), std::to_string(0xbcde));
}

// "SCAN": the record has the inputs of the last time when it was processed.
TEST_F(MbbiDirectDigitalIo, APolledRecordReadsWhenItProcesses) {
  startServers();
  const Ioc ioc(polled("address=0xff"));
  waitForServer("polled");

  for (const int inputs : {0x01, 0x80, 0x00}) {
    model_->setInputs(kAll, static_cast<std::uint32_t>(inputs));
    process("polled");
    EXPECT_EQ(Ioc::get("polled"), std::to_string(inputs));
  }
}

// "I/O event scanning is only supported for those card types that interrupt.": the server sends the
// inputs when the record has connected, and each change of the bits in its mask.
TEST_F(MbbiDirectDigitalIo, AnIoEventRecordFollowsEachChange) {
  startServers();
  model_->setInputs(kAll, 0x12);
  const Ioc ioc(monitored("address=0xff", "field(NOBT, \"8\") field(FLNK, \"count\")") +
                R"(record(calc, "count") { field(CALC, "VAL+1") })");
  Ioc::waitFor("monitored", std::to_string(0x12));

  model_->setInputs(kAll, 0xff0012);  // no bit of the mask
  model_->setInputs(kAll, 0xff0034);
  Ioc::waitFor("monitored", std::to_string(0x34));
  Ioc::waitFor("count", "2");
  EXPECT_EQ(Ioc::get("monitored.B4"), "1");
  EXPECT_EQ(Ioc::get("monitored.SEVR"), "NO_ALARM");
}

// Records with I/O Intr on the same lines, each with a monitor of its own.
TEST_F(MbbiDirectDigitalIo, IoEventRecordsHaveTheirOwnBits) {
  startServers();
  model_->setInputs(kAll, 0);
  const Ioc ioc(monitored("address=0xf0 shift=4", "field(NOBT, \"4\")") +
                R"(record(mbbiDirect, "low") { field(DTYP, "MPF") field(SCAN, "I/O Intr")
                  field(INP, "@c-UnidigIn cmd=3 address=0xf") field(NOBT, "4") })");
  Ioc::waitFor("low.UDF", "0");
  Ioc::waitFor("monitored.UDF", "0");

  model_->setInputs(kAll, 0xff53);

  Ioc::waitFor("monitored", "5");
  Ioc::waitFor("low", "3");
}

// "the INP field must contain the address of the I/O card": another text is an error, and the
// record never processes.
TEST_F(MbbiDirectDigitalIo, ARecordWithAnInvalidAddressNeverProcesses) {
  startServers();
  const Ioc ioc(polled("bit=3"));

  EXPECT_EQ(Ioc::get("polled.PACT"), "1");
  EXPECT_EQ(Ioc::get("polled.UDF"), "1");
}

// "The possible alarm conditions ... are the SCAN and READ alarms.": READ, while the server cannot
// read the module; VAL is kept. "they are always of MAJOR severity": DevMpf sets INVALID.
TEST_F(MbbiDirectDigitalIo, AModuleThatIsAbsentIsAReadAlarm) {
  startServers();
  model_->setInputs(kAll, 0x12);
  const Ioc ioc(polled("address=0xff") + monitored("address=0xff"));
  waitForServer("polled");
  Ioc::waitFor("monitored", std::to_string(0x12));

  carrier_.unplug("IP_a");
  io_->look();
  process("polled");
  Ioc::waitFor("monitored.STAT", "READ");
  EXPECT_EQ(Ioc::get("polled.STAT"), "READ");
  for (const std::string record : {"polled", "monitored"}) {
    EXPECT_EQ(Ioc::get(record + ".SEVR"), "INVALID");
    EXPECT_EQ(Ioc::get(record + ".AMSG"), "status -1 from the server");
    EXPECT_EQ(Ioc::get(record), std::to_string(0x12));
  }

  plug();
  model_->setInputs(kAll, 0x34);
  io_->look();
  process("polled");
  Ioc::waitFor("monitored", std::to_string(0x34));
  for (const std::string record : {"polled", "monitored"})
    EXPECT_EQ(Ioc::get(record + ".SEVR"), "NO_ALARM");
}

// An alarm that the manual does not have: COMM, while the server is absent.
TEST_F(MbbiDirectDigitalIo, AServerThatIsAbsentIsACommAlarm) {
  model_->setInputs(kAll, 0x12);
  const Ioc ioc(polled("address=0xff") + monitored("address=0xff"));
  process("polled");
  EXPECT_EQ(Ioc::get("polled.STAT"), "COMM");
  EXPECT_EQ(Ioc::get("polled.SEVR"), "INVALID");

  startServers();
  Ioc::waitFor("polled.SEVR", "NO_ALARM");
  Ioc::waitFor("monitored", std::to_string(0x12));

  stopServers();
  Ioc::waitFor("polled.STAT", "COMM");
  Ioc::waitFor("monitored.STAT", "COMM");
  EXPECT_EQ(Ioc::get("monitored"), std::to_string(0x12));

  model_->setInputs(kAll, 0x34);
  startServers();
  Ioc::waitFor("polled", std::to_string(0x34));
  Ioc::waitFor("monitored", std::to_string(0x34));
}

// "used to operate the mbbiDirect record in the simulation mode": the server is not needed.
TEST_F(MbbiDirectDigitalIo, SimulationModeDoesNotNeedTheServer) {
  model_->setInputs(kAll, 0x12);
  const Ioc ioc(
      polled("address=0xff", "field(SIMM, \"YES\") field(SIOL, \"value\") field(SIMS, \"MINOR\")") +
      R"(record(longin, "value") { field(VAL, "7") })");
  process("polled");
  EXPECT_EQ(Ioc::get("polled"), "7");
  EXPECT_EQ(Ioc::get("polled.STAT"), "SIMM");
  EXPECT_EQ(Ioc::get("polled.SEVR"), "MINOR");

  startServers();
  ASSERT_EQ(Ioc::put("polled.SIMM", "NO"), 0);
  process("polled");
  waitForServer("polled");
  EXPECT_EQ(Ioc::get("polled"), std::to_string(0x12));
}

// The change that arrives during a simulation is the value after it.
TEST_F(MbbiDirectDigitalIo, AnIoEventRecordHasTheLastChangeAfterASimulation) {
  startServers();
  model_->setInputs(kAll, 0x12);
  const Ioc ioc(monitored("address=0xff", "field(SIOL, \"value\") field(FLNK, \"count\")") +
                R"(record(longin, "value") { field(VAL, "7") }
                   record(calc, "count") { field(CALC, "VAL+1") })");
  Ioc::waitFor("monitored", std::to_string(0x12));
  Ioc::waitFor("count", "1");

  ASSERT_EQ(Ioc::put("monitored.SIMM", "YES"), 0);
  model_->setInputs(kAll, 0x34);
  Ioc::waitFor("count", "2");
  EXPECT_EQ(Ioc::get("monitored"), "7");

  ASSERT_EQ(Ioc::put("monitored.SIMM", "NO"), 0);
  process("monitored");
  EXPECT_EQ(Ioc::get("monitored"), std::to_string(0x34));
  EXPECT_EQ(Ioc::get("monitored.SEVR"), "NO_ALARM");
}

}  // namespace
}  // namespace mpf::test
