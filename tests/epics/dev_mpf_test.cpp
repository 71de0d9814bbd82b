// SPDX-License-Identifier: MIT
// Records and servers that are absent, exit, refuse, answer late or answer with another type.
#include <dbLock.h>
#include <epicsTime.h>
#include <limits>
#include <optional>
#include <recSup.h>

#include "tests/epics/epics_fixture.h"

namespace mpf::test {
namespace {

using DevMpfTest = EpicsTest;

constexpr const char* kRecord = R"(record(ai, "v") {
  field(DTYP, "ip330Scan") field(INP, "#C0 S0 @adc") field(PINI, "YES") field(VAL, "7")
})";

void echo(MessageServer& self, Message&& request) {
  static_cast<void>(self.reply(std::move(request)));
}

TEST_F(DevMpfTest, AnAbsentServerIsACommAlarmWithTheReason) {
  const Ioc ioc(kRecord);

  EXPECT_EQ(Ioc::get("v.SEVR"), "INVALID");
  EXPECT_EQ(Ioc::get("v.STAT"), "COMM");
  EXPECT_EQ(Ioc::get("v.PACT"), "0");
  EXPECT_EQ(Ioc::get("v.AMSG"), "server is not running");
}

TEST_F(DevMpfTest, AnAbsentServerIsAnAlarmOfARecordThatHasNotProcessed) {
  const Ioc ioc(R"(record(longin, "v") {
    field(DTYP, "MPF") field(INP, "@adc mode=subscribe") field(SCAN, "I/O Intr")
  })");

  Ioc::waitFor("v.STAT", "COMM");
  EXPECT_EQ(Ioc::get("v.SEVR"), "INVALID");
  EXPECT_EQ(Ioc::get("v.AMSG"), "server is not running");
}

TEST_F(DevMpfTest, ARecordRecoversWhenItsServerStarts) {
  const Ioc ioc(kRecord);
  ASSERT_EQ(Ioc::get("v.STAT"), "COMM");

  const ThreadServer server(backplane_, "adc", echo);

  Ioc::waitFor("v.SEVR", "NO_ALARM");
  EXPECT_EQ(Ioc::get("v.AMSG"), "");
  EXPECT_EQ(Ioc::get("v.NAMSG"), "");
}

TEST_F(DevMpfTest, ARecordIsInvalidWhenItsServerExitsAndRecoversWithTheNext) {
  std::optional<ThreadServer> server(std::in_place, backplane_, "adc", echo);
  const Ioc ioc(kRecord);
  for (int round = 0; round < 3; ++round) {
    Ioc::waitFor("v.SEVR", "NO_ALARM");
    server.reset();
    Ioc::waitFor("v.STAT", "COMM");
    EXPECT_EQ(Ioc::get("v.SEVR"), "INVALID");
    server.emplace(backplane_, "adc", echo);
  }
  Ioc::waitFor("v.SEVR", "NO_ALARM");
}

TEST_F(DevMpfTest, AServerThatExitsWithoutAReplyLeavesNoRecordActive) {
  std::atomic<bool> isTaken = false;
  std::vector<Message> kept;
  std::optional<ThreadServer> server(std::in_place, backplane_, "adc",
                                     [&](MessageServer&, Message&& request) {
                                       kept.push_back(std::move(request));
                                       isTaken = true;
                                     });
  const Ioc ioc(kRecord);
  while (!isTaken) std::this_thread::yield();
  EXPECT_EQ(Ioc::get("v.PACT"), "1");

  kept.clear();
  server.reset();

  Ioc::waitFor("v.PACT", "0");
  EXPECT_EQ(Ioc::get("v.SEVR"), "INVALID");
}

TEST_F(DevMpfTest, ARefusedRequestIsAReadAlarm) {
  const ThreadServer server(backplane_, "adc",
                            [](MessageServer&, Message&& request) { request.reset(); });
  const Ioc ioc(kRecord);

  Ioc::waitFor("v.STAT", "READ");
  EXPECT_EQ(Ioc::get("v.AMSG"), "the server refused the request");
  EXPECT_EQ(Ioc::get("v"), "7");
}

TEST_F(DevMpfTest, AReplyOfAnotherTypeIsAReadAlarm) {
  const ThreadServer server(backplane_, "adc", [](MessageServer& self, Message&& request) {
    static_cast<void>(self.reply(self.allocReplyMessage<Float64>(request)));
  });
  const Ioc ioc(kRecord);

  Ioc::waitFor("v.STAT", "READ");
  EXPECT_EQ(Ioc::get("v.AMSG"), "the reply is not an Int32 message");
}

// A server may send a notice while it keeps a request, which ends by it; a reply may follow.
TEST_F(DevMpfTest, AnOutOfBandMessageBeforeTheReplyLeavesNoRecordActive) {
  std::atomic<bool> hasReplied = false;
  const ThreadServer server(backplane_, "adc", [&](MessageServer& self, Message&& request) {
    if (!hasReplied) static_cast<void>(self.reply(self.allocReplyMessage<OutOfBand>(request)));
    static_cast<void>(self.reply(std::move(request)));
    hasReplied = true;
  });
  const Ioc ioc(R"(
    record(longin, "v") { field(DTYP, "MPF") field(INP, "@adc value=7") field(PINI, "YES") }
    record(longin, "next") { field(DTYP, "MPF") field(INP, "@adc value=8") }
  )");
  while (!hasReplied) std::this_thread::yield();

  static_cast<void>(Ioc::put("next.PROC", "1"));
  Ioc::waitFor("next", "8");  // after all messages of the other record

  EXPECT_EQ(Ioc::get("v.PACT"), "0");
  EXPECT_EQ(Ioc::get("v"), "7");
  EXPECT_EQ(Ioc::get("v.SEVR"), "NO_ALARM");
}

TEST_F(DevMpfTest, AnOutOfBandMessageInPlaceOfAReplyIsAReadAlarm) {
  const ThreadServer server(backplane_, "adc", [](MessageServer& self, Message&& request) {
    static_cast<void>(self.reply(self.allocReplyMessage<OutOfBand>(request)));
  });
  const Ioc ioc(kRecord);

  Ioc::waitFor("v.STAT", "READ");
  EXPECT_EQ(Ioc::get("v.AMSG"), "the reply is an OutOfBand message");
}

TEST_F(DevMpfTest, ANegativeStatusIsAReadAlarm) {
  const ThreadServer server(backplane_, "adc", [](MessageServer& self, Message&& request) {
    request.tryAs<Int32>()->status = -1;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(kRecord);

  Ioc::waitFor("v.STAT", "READ");
}

TEST_F(DevMpfTest, AServerThatDoesNotReplyIsATimeoutAlarm) {
  std::vector<Message> kept;
  const ThreadServer server(backplane_, "adc", [&](MessageServer&, Message&& request) {
    kept.push_back(std::move(request));
  });
  const Ioc ioc(kRecord);

  Ioc::waitFor("v.STAT", "TIMEOUT");
  EXPECT_EQ(Ioc::get("v.PACT"), "0");
  EXPECT_EQ(Ioc::get("v.AMSG"), "no reply in 5 s");
  kept.clear();
}

const std::string kStampedRecord =
    "record(longin, \"v\") { field(DTYP, \"MPF\") field(INP, \"@adc value=7\")"
    " field(PINI, \"YES\") field(TSE, \"-2\") }";

TEST_F(DevMpfTest, ADeviceTimeStampIsThatOfTheServer) {
  std::atomic<std::int64_t> stampNs = 946'684'800'123'456'789;
  const ThreadServer server(backplane_, "adc", [&](MessageServer& self, Message&& request) {
    request.setTimeStampNs(stampNs);
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(kStampedRecord);
  Ioc::waitFor("v", "7");
  EXPECT_EQ(Ioc::timeOf("v").secPastEpoch, 946'684'800u - POSIX_TIME_AT_EPICS_EPOCH);
  EXPECT_EQ(Ioc::timeOf("v").nsec, 123'456'789u);
}

// Times that EPICS cannot represent: the time of the IOC.
TEST_F(DevMpfTest, AnImpossibleTimeStampIsNotUsed) {
  epicsTimeStamp before;
  epicsTimeGetCurrent(&before);
  for (const auto stampNs :
       {std::int64_t{-1}, std::int64_t{1}, std::int64_t{631'151'999'999'999'999},
        std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()}) {
    const ThreadServer server(backplane_, "adc", [&](MessageServer& self, Message&& request) {
      request.setTimeStampNs(stampNs);
      static_cast<void>(self.reply(std::move(request)));
    });
    const Ioc ioc(kStampedRecord);
    Ioc::waitFor("v", "7");
    const auto stamp = Ioc::timeOf("v");
    EXPECT_GE(epicsTimeDiffInSeconds(&stamp, &before), 0) << stampNs;
  }
}

TEST_F(DevMpfTest, ADeviceTimeStampIsTheTimeOfAMessageWithoutOne) {
  const ThreadServer server(backplane_, "adc", echo);
  epicsTimeStamp before;
  epicsTimeGetCurrent(&before);
  const Ioc ioc(kStampedRecord);
  Ioc::waitFor("v", "7");

  const auto stamp = Ioc::timeOf("v");
  epicsTimeStamp after;
  epicsTimeGetCurrent(&after);
  EXPECT_GE(epicsTimeDiffInSeconds(&stamp, &before), 0);
  EXPECT_LE(epicsTimeDiffInSeconds(&stamp, &after), 0);
}

TEST_F(DevMpfTest, ADeviceTimeStampOfAFailureIsTheCurrentTime) {
  constexpr std::int64_t kStampNs = 946'684'800'000'000'000;
  std::optional<ThreadServer> server(std::in_place, backplane_, "adc",
                                     [&](MessageServer& self, Message&& request) {
                                       request.setTimeStampNs(kStampNs);
                                       static_cast<void>(self.reply(std::move(request)));
                                     });
  const Ioc ioc(kStampedRecord);
  Ioc::waitFor("v", "7");
  epicsTimeStamp before;
  epicsTimeGetCurrent(&before);

  server.reset();
  Ioc::waitFor("v.STAT", "COMM");

  const auto atEnd = Ioc::timeOf("v");
  EXPECT_GE(epicsTimeDiffInSeconds(&atEnd, &before), 0);
  static_cast<void>(Ioc::put("v.PROC", "1"));
  const auto atProcessing = Ioc::timeOf("v");
  EXPECT_GT(epicsTimeDiffInSeconds(&atProcessing, &atEnd), 0);
}

TEST_F(DevMpfTest, AnIocShutsDownWithRequestsOutstanding) {
  std::atomic<bool> isTaken = false;
  std::vector<Message> kept;
  const ThreadServer server(backplane_, "adc", [&](MessageServer&, Message&& request) {
    kept.push_back(std::move(request));
    isTaken = true;
  });
  {
    const Ioc ioc(kRecord);
    while (!isTaken) std::this_thread::yield();
  }
  kept.clear();
}

TEST_F(DevMpfTest, MoreRecordsThanTheQueueOfTheServerAllGetTheirValue) {
  const ThreadServer server(backplane_, "adc", echo);
  std::string database;
  constexpr int kRecords = 500;
  for (int number = 0; number < kRecords; ++number)
    database +=
        "record(ai, \"v" + std::to_string(number) +
        "\") { field(DTYP, \"ip330Scan\") field(INP, \"#C0 S0 @adc\") field(PINI, \"YES\") }\n";
  const Ioc ioc(database);

  for (int number = 0; number < kRecords; ++number)
    Ioc::waitFor("v" + std::to_string(number) + ".SEVR", "NO_ALARM");
}

// A server that sends without end costs overruns, and the IOC goes on.
TEST_F(DevMpfTest, AServerThatSendsWithoutEndCostsOverrunsOnly) {
  std::atomic<bool> isOver = false;
  const ThreadServer server(backplane_, "adc", [&](MessageServer& self, Message&& request) {
    for (std::int32_t value = 0; !isOver; ++value) {
      auto reply = self.allocReplyMessage<Int32>(request);
      reply->value = value;
      static_cast<void>(self.reply(std::move(reply)));
    }
  });
  const Ioc ioc(std::string(kRecord) + R"(record(ai, "other") { field(INP, "3") })");
  Ioc::waitFor("v.SEVR", "NO_ALARM");
  const auto before = Ioc::get("v.RVAL");
  while (Ioc::get("v.RVAL") == before) std::this_thread::yield();

  ASSERT_EQ(Ioc::put("other.PROC", "1"), 0);
  EXPECT_EQ(Ioc::get("other"), "3");
  isOver = true;
}

// The end of the delay SDLY, for which the record waits.
void endSimulationDelay(const char* name) {
  DBADDR address;
  ASSERT_EQ(dbNameToAddr(name, &address), 0);
  dbScanLock(address.precord);
  static_cast<void>(address.precord->rset->process(address.precord));
  dbScanUnlock(address.precord);
}

// Then EPICS Base lets device support begin, and completes the record without a reply.
TEST_F(DevMpfTest, ARecordWhoseSimulationIsSwitchedOffDuringItsDelaySendsNothing) {
  std::atomic<int> requests = 0;
  const ThreadServer server(backplane_, "adc", [&](MessageServer& self, Message&& request) {
    ++requests;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(
      "record(longin, \"v\") { field(DTYP, \"MPF\") field(INP, \"@adc value=7\")"
      " field(PINI, \"YES\") field(SDLY, \"3600\") }");
  Ioc::waitFor("v.SEVR", "NO_ALARM");
  ASSERT_EQ(Ioc::put("v.SIMM", "YES"), 0);
  ASSERT_EQ(Ioc::put("v.PROC", "1"), 0);
  ASSERT_EQ(Ioc::get("v.PACT"), "1");
  ASSERT_EQ(Ioc::put("v.SIMM", "NO"), 0);

  endSimulationDelay("v");

  EXPECT_EQ(Ioc::get("v.PACT"), "0");
  EXPECT_EQ(Ioc::get("v.STAT"), "READ");
  EXPECT_EQ(Ioc::get("v.AMSG"), "SIMM was changed during SDLY");
  ASSERT_EQ(Ioc::put("v.PROC", "1"), 0);
  Ioc::waitFor("v.SEVR", "NO_ALARM");
  EXPECT_EQ(requests, 2);
}

}  // namespace
}  // namespace mpf::test
