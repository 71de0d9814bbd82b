// SPDX-License-Identifier: MIT
// mbbiDirect records whose INP is a Channel Access link, in the program mpf-ioc.
#include <cstdlib>
#include <gtest/gtest.h>

#include <mpf/message_server.h>

#include "tests/support/program.h"
#include "tests/support/router_pair.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

// The IOC is its own Channel Access client, on loopback and on a port of its own.
class MbbiDirectChannelAccess : public testing::Test {
 protected:
  MbbiDirectChannelAccess() {
    const auto port = port_.address().substr(port_.address().rfind(':') + 1);
    ::setenv("EPICS_CA_SERVER_PORT", port.c_str(), 1);
    ::setenv("EPICS_CA_ADDR_LIST", "127.0.0.1", 1);
    ::setenv("EPICS_CA_AUTO_ADDR_LIST", "NO", 1);
    ::setenv("EPICS_CAS_INTF_ADDR_LIST", "127.0.0.1", 1);
    ::setenv("EPICS_CAS_BEACON_ADDR_LIST", "127.0.0.1", 1);
    ::setenv("EPICS_CAS_AUTO_BEACON_ADDR_LIST", "NO", 1);
    ::setenv("PVXS_QSRV_ENABLE", "NO", 1);
    ::setenv("MPF_BACKPLANE", backplane_.name().c_str(), 1);
  }
  FreePort port_;
  TestBackplane backplane_;
  const Watchdog watchdog_{"Channel Access test"};
};

// "the INP field can be a constant, a database, or a channel access link"
// "If the INP link type is PV_LINK, then dbCaAddInlink is called by init_record."
// A link with CP is a Channel Access link also to a record of the same IOC. Another record writes
// each new value to a server of the test.
TEST_F(MbbiDirectChannelAccess, IsAnInputOfSoftAndRawSoftChannels) {
  MessageServer server(backplane_, "lamp");
  const TemporaryFolder folder;
  const auto database = folder.write("a.db", R"(
    record(calc, "src") { field(CALC, "VAL+16") field(SCAN, ".1 second") }
    record(mbbiDirect, "soft") { field(INP, "src CP") field(FLNK, "softSeen") }
    record(mbbiDirect, "raw") { field(DTYP, "Raw Soft Channel") field(INP, "src CP")
      field(SHFT, "4") field(FLNK, "rawSeen") }
    record(longout, "softSeen") { field(DTYP, "MPF") field(OUT, "@lamp address=1")
      field(OMSL, "closed_loop") field(DOL, "soft") }
    record(longout, "rawSeen") { field(DTYP, "MPF") field(OUT, "@lamp address=2")
      field(OMSL, "closed_loop") field(DOL, "raw") }
  )");
  Program ioc({MPF_TEST_IOC, "-S", "-d", database});

  bool isSoftSeen = false;
  bool isRawShifted = false;  // the raw record has sent an odd value
  while (!isSoftSeen || !isRawShifted) {
    auto request = server.receive();
    if (!request) {
      server.waitForMessage();
      continue;
    }
    const auto* fields = request.tryAs<Int32>();
    ASSERT_NE(fields, nullptr);
    if (fields->address == 2) {
      isRawShifted = isRawShifted || fields->value % 2 == 1;
    } else {
      isSoftSeen = isSoftSeen || fields->value > 0;
      EXPECT_EQ(fields->value % 16, 0) << "not shifted: Soft Channel";
    }
    static_cast<void>(server.reply(std::move(request)));
  }
  EXPECT_EQ(ioc.end(SIGTERM), 0);
}

}  // namespace
}  // namespace mpf::test
