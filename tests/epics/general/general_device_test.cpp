// SPDX-License-Identifier: MIT
// Requests, writes and subscriptions of records with DTYP "MPF": failures, and servers that come
// and go.
#include <limits>
#include <optional>
#include <string>

#include "tests/epics/epics_fixture.h"
#include "tests/shm/child.h"

namespace mpf::test {
namespace {

using GeneralDeviceTest = EpicsTest;

std::string longin(const std::string& link, const std::string& fields = "field(PINI, \"YES\")") {
  return "record(longin, \"v\") { field(DTYP, \"MPF\") field(INP, \"" + link +
         "\") field(VAL, \"9\") " + fields + " }\n";
}
std::string longout(const std::string& link, const std::string& fields = "") {
  return "record(longout, \"v\") { field(DTYP, \"MPF\") field(OUT, \"" + link + "\") " + fields +
         " }\n";
}
constexpr const char* kIoInterrupt = "field(SCAN, \"I/O Intr\")";

TEST_F(GeneralDeviceTest, ARequestHasTheFieldsOfTheLink) {
  std::atomic<bool> isAsExpected = false;
  const ThreadServer server(backplane_, "s", [&](MessageServer& self, Message&& request) {
    const auto* fields = request.tryAs<Int32>();
    isAsExpected = fields->cmd == 1 && fields->address == 3 && fields->extra == -4 &&
                   fields->timeout == 3 && fields->value == 2;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(longin("@s:0 type=int32 cmd=1 address=3 extra=-4 timeout=2.5 value=2"));

  Ioc::waitFor("v", "2");

  EXPECT_TRUE(isAsExpected);
  EXPECT_EQ(Ioc::get("v.SEVR"), "NO_ALARM");
}

TEST_F(GeneralDeviceTest, AnInvalidLinkDisablesTheRecord) {
  for (const char* link : {"@s adress=3", "@s cmd=x", "@", "@s mode=write", "s cmd=1",
                           "@s type=float64 shift=1", "@s value=1e99"}) {
    SCOPED_TRACE(link);
    const Ioc ioc(longin(link));

    EXPECT_EQ(Ioc::get("v.PACT"), "1");
    EXPECT_EQ(Ioc::get("v.SEVR"), "INVALID");
    EXPECT_EQ(Ioc::get("v.STAT"), "LINK");
    EXPECT_NE(Ioc::get("v.AMSG"), "");
    EXPECT_EQ(Ioc::get("v"), "9");
  }
}

TEST_F(GeneralDeviceTest, AStatusOtherThanZeroIsAReadAlarmAndKeepsTheValue) {
  const ThreadServer server(backplane_, "s", [](MessageServer& self, Message&& request) {
    request.tryAs<Int32>()->status = -3;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(longin("@s"));

  Ioc::waitFor("v.STAT", "READ");
  EXPECT_EQ(Ioc::get("v.SEVR"), "INVALID");
  EXPECT_EQ(Ioc::get("v.AMSG"), "status -3 from the server");
  EXPECT_EQ(Ioc::get("v"), "9");
}

TEST_F(GeneralDeviceTest, ANumberThatDoesNotFitIsAReadAlarmAndKeepsTheValue) {
  std::atomic<double> value = std::numeric_limits<double>::quiet_NaN();
  const ThreadServer server(backplane_, "s", [&](MessageServer& self, Message&& request) {
    request.tryAs<Float64>()->value = value;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(
      longin("@s type=float64") +
      "record(ai, \"a\") { field(DTYP, \"MPF\") field(INP, \"@s\") field(PINI, \"YES\") }");
  Ioc::waitFor("v.STAT", "READ");
  EXPECT_EQ(Ioc::get("v.AMSG"), "the value does not fit the record");
  EXPECT_EQ(Ioc::get("v"), "9");
  Ioc::waitFor("a.STAT", "UDF");
  EXPECT_EQ(Ioc::get("a"), "nan");

  value = 3;
  ASSERT_EQ(Ioc::put("v.PROC", "1"), 0);
  Ioc::waitFor("v", "3");
  EXPECT_EQ(Ioc::get("v.SEVR"), "NO_ALARM");
}

TEST_F(GeneralDeviceTest, AReplyWithoutAValueIsAReadAlarm) {
  const ThreadServer server(backplane_, "s", [](MessageServer& self, Message&& request) {
    static_cast<void>(self.reply(self.allocReplyMessage<SerialConfig>(request)));
  });
  const Ioc ioc(longin("@s"));

  Ioc::waitFor("v.AMSG", "serialConfig has no value");
}

TEST_F(GeneralDeviceTest, TheTimeoutOfTheLinkEndsARequest) {
  std::vector<Message> kept;
  const ThreadServer server(backplane_, "s", [&](MessageServer&, Message&& request) {
    kept.push_back(std::move(request));
  });
  const Ioc ioc(longin("@s timeout=0.1"));

  Ioc::waitFor("v.AMSG", "no reply in 0.1 s");
  EXPECT_EQ(Ioc::get("v.STAT"), "TIMEOUT");
  kept.clear();
}

TEST_F(GeneralDeviceTest, AValueThatDoesNotFitTheMessageIsNotWritten) {
  std::atomic<int> requests = 0;
  const ThreadServer server(backplane_, "s", [&](MessageServer& self, Message&& request) {
    ++requests;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(
      "record(int64out, \"v\") { field(DTYP, \"MPF\") field(OUT, \"@s\") field(VAL, \"0\") "
      "field(PINI, \"YES\") }");
  while (requests == 0) std::this_thread::yield();
  Ioc::waitFor("v.PACT", "0");

  EXPECT_NE(Ioc::put("v", "4294967296"), 0);

  EXPECT_EQ(Ioc::get("v.STAT"), "WRITE");
  EXPECT_EQ(Ioc::get("v.AMSG"), "the value does not fit the message");
  EXPECT_EQ(requests, 1);
}

// Doubles above 2^53 are even.
TEST_F(GeneralDeviceTest, AnIntegerThatADoubleCannotHoldIsNotWritten) {
  std::atomic<int> requests = 0;
  const ThreadServer server(backplane_, "s", [&](MessageServer& self, Message&& request) {
    ++requests;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(R"(
    record(int64out, "v") { field(DTYP, "MPF") field(OUT, "@s type=float64")
      field(VAL, "9007199254740993") field(PINI, "YES") }
    record(aao, "a") { field(DTYP, "MPF") field(OUT, "@s") field(FTVL, "INT64") field(NELM, "2") }
    record(aao, "u") { field(DTYP, "MPF") field(OUT, "@s") field(FTVL, "UINT64") field(NELM, "2") }
  )");
  Ioc::waitFor("v.AMSG", "the value does not fit the message");
  for (const std::string name : {"v", "a", "u"}) {
    static_cast<void>(Ioc::put(name, "9007199254740993"));
    EXPECT_EQ(Ioc::get(name + ".STAT"), "WRITE") << name;
    EXPECT_EQ(Ioc::get(name + ".AMSG"), "the value does not fit the message") << name;
  }
  EXPECT_EQ(requests, 0);

  for (const std::string name : {"v", "a", "u"}) {
    ASSERT_EQ(Ioc::put(name, "9007199254740994"), 0);
    Ioc::waitFor(name + ".SEVR", "NO_ALARM");
  }
  EXPECT_EQ(requests, 3);
}

TEST_F(GeneralDeviceTest, ARefusedWriteIsAWriteAlarm) {
  const ThreadServer server(backplane_, "s", [](MessageServer& self, Message&& request) {
    request.tryAs<Int32>()->status = -1;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(longout("@s", "field(VAL, \"4\") field(PINI, \"YES\")"));

  Ioc::waitFor("v.STAT", "WRITE");
  EXPECT_EQ(Ioc::get("v.AMSG"), "status -1 from the server");
}

// ---- subscriptions

// Sends `first` and then `first` + 1 to each subscriber.
class Publisher {
 public:
  Publisher(const Backplane& backplane, std::int32_t first)
      : first_(first), server_(backplane, "s", [this](MessageServer& self, Message&& request) {
          ++requests_;
          auto reply = self.allocReplyMessage<Int32>(request);
          reply->value = first_;
          static_cast<void>(self.reply(std::move(reply)));
          auto next = self.allocReplyMessage<Int32>(request);
          next->value = first_ + 1;
          static_cast<void>(self.reply(std::move(next)));
          request.reset();
        }) {}
  int requests() const { return requests_; }

 private:
  std::int32_t first_;
  std::atomic<int> requests_ = 0;
  ThreadServer server_;
};

TEST_F(GeneralDeviceTest, ASubscriptionProcessesTheRecordForEachMessageAndIsRenewed) {
  std::optional<Publisher> server(std::in_place, backplane_, 10);
  const Ioc ioc(longin("@s cmd=3", std::string(kIoInterrupt) + " field(FLNK, \"count\")") +
                "record(calc, \"count\") { field(CALC, \"VAL+1\") }\n");
  Ioc::waitFor("v", "11");
  EXPECT_EQ(Ioc::get("v.SEVR"), "NO_ALARM");
  EXPECT_EQ(Ioc::get("count"), "2");
  EXPECT_EQ(server->requests(), 1);

  server.reset();
  Ioc::waitFor("v.STAT", "COMM");
  server.emplace(backplane_, 20);

  Ioc::waitFor("v", "21");
  EXPECT_EQ(Ioc::get("v.SEVR"), "NO_ALARM");
  EXPECT_EQ(Ioc::get("count"), "4");
}

TEST_F(GeneralDeviceTest, ASubscribedRecordThatProcessesSendsNothingAndKeepsItsValue) {
  const Publisher server(backplane_, 10);
  const Ioc ioc(longin("@s cmd=3 mode=subscribe", ""));
  Ioc::waitFor("v", "11");

  ASSERT_EQ(Ioc::put("v.PROC", "1"), 0);

  EXPECT_EQ(Ioc::get("v"), "11");
  EXPECT_EQ(Ioc::get("v.SEVR"), "NO_ALARM");
  EXPECT_EQ(server.requests(), 1);
}

// With SMOO, Base would approach RVAL each time that the record processes.
TEST_F(GeneralDeviceTest, ASubscribedRecordThatProcessesKeepsItsSmoothedValue) {
  const Publisher server(backplane_, 10);
  const Ioc ioc(R"(record(ai, "v") { field(DTYP, "MPF") field(INP, "@s type=int32 mode=subscribe")
    field(SMOO, "0.5") field(PREC, "6") })");
  Ioc::waitFor("v.RVAL", "11");
  const auto smoothed = Ioc::get("v");

  ASSERT_EQ(Ioc::put("v.PROC", "1"), 0);

  EXPECT_EQ(Ioc::get("v"), smoothed);
  EXPECT_EQ(Ioc::get("v.SEVR"), "NO_ALARM");
}

TEST_F(GeneralDeviceTest, ARefusedSubscriptionIsAReadAlarmAndRepeatedWhenTheRecordProcesses) {
  std::atomic<bool> isRefusing = true;
  const ThreadServer server(backplane_, "s", [&](MessageServer& self, Message&& request) {
    if (isRefusing) return request.reset();
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(longin("@s value=4 mode=subscribe", ""));
  Ioc::waitFor("v.AMSG", "the server refused the request");
  EXPECT_EQ(Ioc::get("v.STAT"), "READ");

  isRefusing = false;
  static_cast<void>(Ioc::put("v.PROC", "1"));

  Ioc::waitFor("v", "4");
  EXPECT_EQ(Ioc::get("v.SEVR"), "NO_ALARM");
}

// The other records follow a change of the alarm: "bit" is a record of device support of its own.
TEST_F(GeneralDeviceTest, ASubscribedRecordIsInvalidWhileItsServerIsStopped) {
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP() << "ThreadSanitizer allows no threads in the child of a process that has some";
#endif
  Child server([&](Child::Self& self) {
    MessageServer echo(Backplane::attach(backplane_.name()), "s");
    self.ready();
    for (;; echo.waitForMessage())
      while (auto request = echo.receive()) static_cast<void>(echo.reply(std::move(request)));
  });
  server.go();
  const Ioc ioc(longin("@s value=4", kIoInterrupt) + R"(
    record(longin, "in") { field(DTYP, "Greenspring IP-Unidig") field(INP, "#C0 S0 @s")
      field(PINI, "YES") }
    record(bi, "bit") { field(DTYP, "Greenspring IP-Unidig") field(INP, "#C0 S0 @in")
      field(SCAN, "I/O Intr") }
  )");
  Ioc::waitFor("v", "4");
  Ioc::waitFor("bit.SEVR", "NO_ALARM");

  server.stop();

  for (const std::string name : {"v", "in", "bit"}) {
    Ioc::waitFor(name + ".STAT", "COMM");
    EXPECT_EQ(Ioc::get(name + ".SEVR"), "INVALID");
    EXPECT_EQ(Ioc::get(name + ".AMSG"), "server is stopped");
  }
  static_cast<void>(Ioc::put("v.PROC", "1"));
  EXPECT_EQ(Ioc::get("v.STAT"), "COMM");

  server.resume();

  for (const std::string name : {"v", "in", "bit"}) {
    Ioc::waitFor(name + ".SEVR", "NO_ALARM");
    EXPECT_EQ(Ioc::get(name + ".AMSG"), "");
  }
  EXPECT_EQ(Ioc::get("v"), "4");
}

TEST_F(GeneralDeviceTest, ASubscriptionThatTheServerDidNotReceiveInTimeIsSentAgain) {
  MessageServer server(backplane_, "s");
  const auto receive = [&] {
    Message request;
    while (!(request = server.receive())) server.waitForMessage();
    return request;
  };
  const Ioc ioc(longin("@s mode=subscribe timeout=0.01", ""));
  receive().reset();  // refused
  Ioc::waitFor("v.AMSG", "the server refused the request");

  static_cast<void>(Ioc::put("v.PROC", "1"));
  const auto expired = Deadline::after(std::chrono::milliseconds(20));
  while (!expired.hasPassed()) std::this_thread::yield();

  auto request = receive();
  request.tryAs<Int32>()->value = 4;
  EXPECT_EQ(server.reply(std::move(request)), ReplyResult::sent);
  Ioc::waitFor("v", "4");
}

}  // namespace
}  // namespace mpf::test
