// SPDX-License-Identifier: MIT
// Inputs and outputs of an IP-Unidig, with the messages of their servers.
#include <registryFunction.h>
#include <string>
#include <subRecord.h>
#include <thread>
#include <vector>

#include <mpf/digital_io_commands.h>

#include "tests/epics/epics_fixture.h"

namespace mpf::test {
namespace {

using UnidigRecordTest = EpicsTest;

TEST_F(UnidigRecordTest, InputsFollowEachChange) {
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

// Each message processes the longin, which must not ask for the next one by itself.
TEST_F(UnidigRecordTest, InputsWithIoEventScanningSubscribeOnceAndFollowEachChange) {
  for (const std::string pini : {"YES", "NO"}) {
    SCOPED_TRACE("PINI " + pini);
    std::atomic<int> requests = 0;
    const ThreadServer server(backplane_, "c-UnidigIn",
                              [&](MessageServer& self, Message&& request) {
                                ++requests;
                                for (std::int32_t value = 1; value <= 20; ++value) {
                                  auto reply = self.allocReplyMessage<Int32>(request);
                                  reply->value = value;
                                  static_cast<void>(self.reply(std::move(reply)));
                                }
                              });
    const Ioc ioc(R"(
      record(longin, "in") { field(DTYP, "Greenspring IP-Unidig") field(INP, "#C0 S0 @c-UnidigIn")
        field(SCAN, "I/O Intr") field(PINI, ")" +
                  pini + R"(") }
      record(bi, "bit4") { field(DTYP, "Greenspring IP-Unidig") field(INP, "#C0 S4 @in")
        field(SCAN, "I/O Intr") field(ZNAM, "off") field(ONAM, "on") }
    )");

    while (requests < 2 && Ioc::get("in") != "20") std::this_thread::yield();

    ASSERT_EQ(requests, 1);
    Ioc::waitFor("bit4", "on");
  }
}

TEST_F(UnidigRecordTest, InputsSubscribeWhenTheyAreChangedToIoEventScanning) {
  const ThreadServer server(backplane_, "c-UnidigIn", [](MessageServer& self, Message&& request) {
    request.tryAs<Int32>()->value = 7;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(R"(
    record(longin, "in") { field(DTYP, "Greenspring IP-Unidig") field(INP, "#C0 S0 @c-UnidigIn") }
    record(longin, "other") { field(DTYP, "Greenspring IP-Unidig")
      field(INP, "#C0 S1 @c-UnidigIn") field(SCAN, "I/O Intr") }
  )");
  Ioc::waitFor("other", "7");
  EXPECT_EQ(Ioc::get("in"), "0");

  ASSERT_EQ(Ioc::put("in.SCAN", "I/O Intr"), 0);

  Ioc::waitFor("in", "7");
}

TEST_F(UnidigRecordTest, OutputsSetAndClearTheirBit) {
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

TEST_F(UnidigRecordTest, AnInputBitHasTheAlarmOfItsInputs) {
  const ThreadServer server(backplane_, "c-UnidigIn", [](MessageServer& self, Message&& request) {
    request.tryAs<Int32>()->status = -1;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(R"(
    record(longin, "in") { field(DTYP, "Greenspring IP-Unidig") field(INP, "#C0 S0 @c-UnidigIn")
      field(PINI, "YES") }
    record(bi, "bit") { field(DTYP, "Greenspring IP-Unidig") field(INP, "#C0 S23 @in")
      field(SCAN, "I/O Intr") }
  )");

  Ioc::waitFor("bit.AMSG", "the server cannot read the inputs");

  EXPECT_EQ(Ioc::get("bit.SEVR"), "INVALID");
}

TEST_F(UnidigRecordTest, AnInputBitHasTheAlarmOfInputsWithoutAReply) {
  std::vector<Message> kept;
  const ThreadServer server(backplane_, "c-UnidigIn", [&](MessageServer&, Message&& request) {
    kept.push_back(std::move(request));
  });
  const Ioc ioc(R"(
    record(longin, "in") { field(DTYP, "Greenspring IP-Unidig") field(INP, "#C0 S0 @c-UnidigIn")
      field(PINI, "YES") }
    record(bi, "bit") { field(DTYP, "Greenspring IP-Unidig") field(INP, "#C0 S0 @in")
      field(SCAN, "I/O Intr") }
  )");

  Ioc::waitFor("bit.STAT", "TIMEOUT");

  EXPECT_EQ(Ioc::get("bit.SEVR"), "INVALID");
  EXPECT_EQ(Ioc::get("bit.AMSG"), "no reply in 5 s");
  kept.clear();
}

// A function of the record "gate", which the longin processes between its reply and its new alarms.
std::string bitsAreProcessedBefore;  // value of "count"; empty: does not wait
long waitForBit(subRecord* /*gate*/) {
  while (!bitsAreProcessedBefore.empty() && Ioc::get("count") == bitsAreProcessedBefore)
    std::this_thread::yield();
  return 0;
}

TEST_F(UnidigRecordTest, AnInputBitThatProcessesBeforeItsInputsHasTheirNewState) {
  std::atomic<std::int32_t> status = -1;
  const ThreadServer server(backplane_, "c-UnidigIn", [&](MessageServer& self, Message&& request) {
    request.tryAs<Int32>()->status = status;
    static_cast<void>(self.reply(std::move(request)));
  });
  registryFunctionAdd("waitForBit", reinterpret_cast<REGISTRYFUNCTION>(waitForBit));
  bitsAreProcessedBefore.clear();
  const Ioc ioc(R"(
    record(sub, "gate") { field(SNAM, "waitForBit") }
    record(longin, "in") { field(DTYP, "Greenspring IP-Unidig") field(INP, "#C0 S0 @c-UnidigIn")
      field(PINI, "YES") field(TSEL, "gate.VAL PP") }
    record(bi, "bit") { field(DTYP, "Greenspring IP-Unidig") field(INP, "#C0 S0 @in")
      field(SCAN, "I/O Intr") field(PRIO, "HIGH") field(FLNK, "count") }
    record(calc, "count") { field(CALC, "VAL+1") }
  )");
  Ioc::waitFor("bit.AMSG", "the server cannot read the inputs");
  Ioc::waitFor("in.PACT", "0");

  status = 0;
  bitsAreProcessedBefore = Ioc::get("count");
  static_cast<void>(Ioc::put("in.PROC", "1"));
  Ioc::waitFor("in.SEVR", "NO_ALARM");

  EXPECT_EQ(Ioc::get("bit.SEVR"), "NO_ALARM");
  EXPECT_EQ(Ioc::get("bit.AMSG"), "");
}

// Such a record has device support data of another type.
TEST_F(UnidigRecordTest, AnInputBitOfALonginOfOtherDeviceSupportNeverProcesses) {
  const Ioc ioc(R"(
    record(longin, "gt") { field(DTYP, "General Time") field(INP, "@GETERRCNT") }
    record(bi, "bit") { field(DTYP, "Greenspring IP-Unidig") field(INP, "#C0 S0 @gt")
      field(SCAN, "I/O Intr") }
  )");

  EXPECT_EQ(Ioc::get("bit.PACT"), "1");
  EXPECT_EQ(Ioc::get("bit.AMSG"), "\"gt\" is not a longin record with DTYP ");
}

TEST_F(UnidigRecordTest, BitsThatDoNotExistAndInputsThatAreNoLonginNeverProcess) {
  const Ioc ioc(R"(
    record(longin, "in") { field(DTYP, "Greenspring IP-Unidig") field(INP, "#C0 S0 @c-In") }
    record(ai, "other") {}
    record(bi, "bit23") { field(DTYP, "Greenspring IP-Unidig") field(INP, "#C0 S23 @in") }
    record(bi, "bit24") { field(DTYP, "Greenspring IP-Unidig") field(INP, "#C0 S24 @in") }
    record(bi, "ofOther") { field(DTYP, "Greenspring IP-Unidig") field(INP, "#C0 S0 @other") }
    record(bi, "ofNone") { field(DTYP, "Greenspring IP-Unidig") field(INP, "#C0 S0 @none") }
    record(bo, "out23") { field(DTYP, "Greenspring IP-Unidig") field(OUT, "#C0 S23 @c-Out") }
    record(bo, "out24") { field(DTYP, "Greenspring IP-Unidig") field(OUT, "#C0 S24 @c-Out") }
  )");

  EXPECT_EQ(Ioc::get("bit23.PACT"), "0");
  EXPECT_EQ(Ioc::get("bit24.PACT"), "1");
  EXPECT_EQ(Ioc::get("ofOther.PACT"), "1");
  EXPECT_EQ(Ioc::get("ofNone.PACT"), "1");
  EXPECT_EQ(Ioc::get("out23.PACT"), "0");
  EXPECT_EQ(Ioc::get("out24.PACT"), "1");
  EXPECT_EQ(Ioc::get("out24.SEVR"), "INVALID");
  EXPECT_EQ(Ioc::get("out24.STAT"), "LINK");
  EXPECT_EQ(Ioc::get("out24.AMSG"), "bit 24: use 0 to 23");
}

}  // namespace
}  // namespace mpf::test
