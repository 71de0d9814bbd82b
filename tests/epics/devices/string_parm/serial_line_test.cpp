// SPDX-License-Identifier: MIT
// Records, a serial server and an instrument on a pseudo-terminal.
#include "tests/epics/ioc.h"
#include "tests/server/programs/serial_server/serial_fixture.h"

namespace mpf::test {
namespace {

class SerialLineRecordTest : public SerialServerTest {
 protected:
  SerialLineRecordTest() { ::setenv("MPF_BACKPLANE", backplane_.name().c_str(), 1); }
};

TEST_F(SerialLineRecordTest, AnOutputRecordAsksAndAnInputRecordReads) {
  ASSERT_NO_FATAL_FAILURE(start());
  const Ioc ioc(R"(
    record(stringout, "ask") { field(DTYP, "Hideos so stringParm") field(VAL, "MEAS:VOLT?")
      field(OUT, "#C0 S0 @serial[0],TERM=0a") field(FLNK, "volt") field(PINI, "YES") }
    record(ai, "volt") { field(DTYP, "Hideos ai stringParm") field(PREC, "3")
      field(INP, "#C0 S0 @serial[0],TERM=0d0a,FMT=%lf,TO=60000") }
  )");

  Ioc::waitFor("volt", "1.234");

  Ioc::waitFor("volt.SEVR", "NO_ALARM");
}

TEST_F(SerialLineRecordTest, MpfWriteReadReturnsTheAnswerWithoutItsEnd) {
  ASSERT_NO_FATAL_FAILURE(start());
  const Ioc ioc(R"(
    record(stringout, "cmd") { field(VAL, "*IDN?\\n") }
    record(stringin, "id") { field(DTYP, "MPFwriteRead") field(INP, "#C0 S0 @serial[0],cmd")
      field(PINI, "YES") }
  )");

  Ioc::waitFor("id", "MPF,INSTRUMENT,0,1.0");
}

}  // namespace
}  // namespace mpf::test
