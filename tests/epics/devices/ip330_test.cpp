// SPDX-License-Identifier: MIT
// ip330Scan and ip330Config, with the messages of their server.
#include <mpf/ip330_commands.h>

#include "tests/epics/epics_fixture.h"

namespace mpf::test {
namespace {

using Ip330RecordTest = EpicsTest;

TEST_F(Ip330RecordTest, ScanConvertsTheCodeOfItsChannelAndGain) {
  const ThreadServer server(backplane_, "adc", [](MessageServer& self, Message&& request) {
    auto* fields = request.tryAs<Int32>();
    fields->value = fields->address == 3 && fields->value == 2 ? 0x8000 : 0;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(R"(record(ai, "v") {
    field(DTYP, "ip330Scan") field(INP, "#C0 S3 @adc,2") field(LINR, "LINEAR")
    field(EGUL, "-5") field(EGUF, "5") field(PREC, "4") field(PINI, "YES")
  })");

  Ioc::waitFor("v.SEVR", "NO_ALARM");

  EXPECT_EQ(Ioc::get("v"), "0.0001");
  EXPECT_EQ(Ioc::get("v.RVAL"), "32768");
}

TEST_F(Ip330RecordTest, ScanWithAnInvalidGainNeverProcesses) {
  const Ioc ioc(R"(record(ai, "v") { field(DTYP, "ip330Scan") field(INP, "#C0 S3 @adc,4") })");

  EXPECT_EQ(Ioc::get("v.PACT"), "1");
}

TEST_F(Ip330RecordTest, ScanOfAChannelThatCannotBeReadIsAnAlarm) {
  const ThreadServer server(backplane_, "adc", [](MessageServer& self, Message&& request) {
    request.tryAs<Int32>()->status = -1;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(R"(record(ai, "v") {
    field(DTYP, "ip330Scan") field(INP, "#C0 S0 @adc") field(PINI, "YES")
  })");

  Ioc::waitFor("v.AMSG", "the server cannot read the channel");

  EXPECT_EQ(Ioc::get("v.SEVR"), "INVALID");
}

TEST_F(Ip330RecordTest, ConfigWritesTheSecondsBetweenCalibrations) {
  std::atomic<std::int32_t> seconds = -1;
  const ThreadServer server(backplane_, "adc", [&](MessageServer& self, Message&& request) {
    auto* fields = request.tryAs<Int32>();
    if (fields->cmd == ip330server::cmdSetSecondsBetweenCalibrate) seconds = fields->value;
    fields->status = fields->value < 0 ? -1 : 0;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(R"(record(longout, "o") {
    field(DTYP, "ip330Config") field(OUT, "#C0 S0 @adc") field(VAL, "60") field(PINI, "YES")
  })");
  while (seconds == -1) std::this_thread::yield();
  EXPECT_EQ(seconds, 60);

  ASSERT_EQ(Ioc::put("o", "-7"), 0);

  Ioc::waitFor("o.AMSG", "the server refused the interval");
  EXPECT_EQ(seconds, -7);
  EXPECT_EQ(Ioc::get("o.STAT"), "WRITE");
}

}  // namespace
}  // namespace mpf::test
