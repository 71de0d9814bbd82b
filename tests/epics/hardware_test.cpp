// SPDX-License-Identifier: MIT
#include <mpf/digital_io_commands.h>
#include <mpf/ip330_commands.h>

#include "tests/epics/epics_fixture.h"

namespace mpf::test {
namespace {

using HardwareRecordTest = EpicsTest;

TEST_F(HardwareRecordTest, Ip330ScanConvertsTheCodeOfItsChannelAndGain) {
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

TEST_F(HardwareRecordTest, Ip330ScanWithAnInvalidGainNeverProcesses) {
  const Ioc ioc(R"(record(ai, "v") { field(DTYP, "ip330Scan") field(INP, "#C0 S3 @adc,4") })");

  EXPECT_EQ(Ioc::get("v.PACT"), "1");
}

TEST_F(HardwareRecordTest, Dac128vWritesTheCodeOfItsChannel) {
  std::atomic<std::int32_t> address = -1;
  std::atomic<std::int32_t> code = -1;
  const ThreadServer server(backplane_, "b-DAC", [&](MessageServer& self, Message&& request) {
    auto* fields = request.tryAs<Int32>();
    address = fields->address;
    code = fields->value;
    fields->status = fields->value > 4095 ? -1 : 0;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(R"(record(ao, "o") {
    field(DTYP, "dac128V") field(OUT, "#C0 S5 @b-DAC") field(LINR, "LINEAR")
    field(EGUL, "-10") field(EGUF, "10") field(VAL, "5") field(PINI, "YES")
  })");

  while (code == -1) std::this_thread::yield();

  EXPECT_EQ(address, 5);
  EXPECT_EQ(code, 3071);
  EXPECT_EQ(Ioc::get("o"), "5") << "the value of the database is kept";

  ASSERT_EQ(Ioc::put("o", "10.5"), 0);
  Ioc::waitFor("o.STAT", "WRITE");
  EXPECT_EQ(Ioc::get("o.SEVR"), "INVALID");
  EXPECT_EQ(Ioc::get("o.AMSG"), "the server refused the value");
}

TEST_F(HardwareRecordTest, UnidigInputsFollowEachChange) {
  std::atomic<std::int32_t> inputs = 5;
  const ThreadServer server(backplane_, "c-UnidigIn", [&](MessageServer& self, Message&& request) {
    for (int message = 0; message < 2; ++message) {
      auto reply = self.allocReplyMessage<Int32>(request);
      reply->value = inputs + message;
      static_cast<void>(self.reply(std::move(reply)));
    }
    request.reset();
  });
  const Ioc ioc(R"(
    record(longin, "in") { field(DTYP, "Greenspring IP-Unidig") field(INP, "#C0 S0 @c-UnidigIn")
      field(PINI, "YES") }
    record(bi, "bit0") { field(DTYP, "Greenspring IP-Unidig") field(INP, "#C0 S0 @in")
      field(SCAN, "I/O Intr") field(ZNAM, "off") field(ONAM, "on") }
    record(bi, "bit1") { field(DTYP, "Greenspring IP-Unidig") field(INP, "#C0 S1 @in")
      field(SCAN, "I/O Intr") field(ZNAM, "off") field(ONAM, "on") }
  )");

  Ioc::waitFor("in", "6");
  Ioc::waitFor("bit1", "on");
  Ioc::waitFor("bit0", "off");
}

TEST_F(HardwareRecordTest, UnidigOutputsSetAndClearTheirBit) {
  std::atomic<std::int32_t> outputs = 0xff;
  const ThreadServer server(backplane_, "c-UnidigOut", [&](MessageServer& self, Message&& request) {
    const auto* fields = request.tryAs<Int32>();
    if (fields->cmd == digital::cmdSetBits) outputs |= fields->address;
    if (fields->cmd == digital::cmdClearBits) outputs &= ~fields->address;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(R"(record(bo, "out") { field(DTYP, "Greenspring IP-Unidig")
    field(OUT, "#C0 S3 @c-UnidigOut") field(VAL, "0") field(PINI, "YES") })");
  while (outputs == 0xff) std::this_thread::yield();
  EXPECT_EQ(outputs, 0xf7);

  ASSERT_EQ(Ioc::put("out", "1"), 0);
  while (outputs != 0xff) std::this_thread::yield();
}

}  // namespace
}  // namespace mpf::test
