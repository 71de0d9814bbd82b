// SPDX-License-Identifier: MIT
// Output records with DTYP "MPF" and their connections: the first value, readback=, rewrite=.
#include <gmock/gmock.h>
#include <longoutRecord.h>
#include <optional>
#include <string>

#include "tests/epics/epics_fixture.h"
#include "tests/epics/field_monitor.h"

namespace mpf::test {
namespace {

class GeneralOutputTest : public EpicsTest {
 protected:
  static std::string longout(const std::string& link, const std::string& fields = "") {
    return "record(longout, \"v\") { field(DTYP, \"MPF\") field(OUT, \"" + link + "\") " + fields +
           " }\n";
  }
};

constexpr std::int32_t kReadBack = 7;

// Has 33 unless a client wrote another value; counts the writes.
class Register {
 public:
  explicit Register(const Backplane& backplane)
      : server_(backplane, "s", [this](MessageServer& self, Message&& request) {
          auto* fields = request.tryAs<Int32>();
          if (fields->cmd == kReadBack) {
            fields->value = value_;
          } else {
            ++writes_;
            value_ = fields->value;
          }
          static_cast<void>(self.reply(std::move(request)));
        }) {}
  int value() const { return value_; }
  int writes() const { return writes_; }

 private:
  std::atomic<int> value_ = 33;
  std::atomic<int> writes_ = 0;
  ThreadServer server_;
};

TEST_F(GeneralOutputTest, AnOutputIsWrittenAtTheFirstConnectionWhenPiniAsksForIt) {
  for (const char* pini : {"YES", "RUN", "RUNNING"}) {
    SCOPED_TRACE(pini);
    const Ioc ioc(longout("@s", std::string("field(VAL, \"5\") field(PINI, \"") + pini + "\")"));
    Ioc::waitFor("v.STAT", "COMM");

    const Register server(backplane_);

    while (server.value() != 5) std::this_thread::yield();
  }
}

// Processing of the record would take the value of DOL, which is not written.
TEST_F(GeneralOutputTest, AValueThatWasReadBackIsNotReplacedByThatOfDol) {
  const Register server(backplane_);
  const Ioc ioc(longout("@s readback=7", "field(OMSL, \"closed_loop\") field(DOL, \"source\")") +
                "record(ao, \"source\") { field(VAL, \"3000\") field(PINI, \"YES\") }\n");

  Ioc::waitFor("v.SEVR", "NO_ALARM");

  EXPECT_EQ(Ioc::get("v"), "33");
  EXPECT_EQ(Ioc::get("v.OMSL"), "closed_loop");
  EXPECT_EQ(server.writes(), 0);

  ASSERT_EQ(Ioc::put("v.PROC", "1"), 0);
  while (server.value() != 3000) std::this_thread::yield();
  Ioc::waitFor("v", "3000");
}

TEST_F(GeneralOutputTest, AValueOutsideTheDriveLimitsThatIsReadBackIsAnAlarm) {
  const Register server(backplane_);
  const std::string limits = "field(VAL, \"4\") field(DRVL, \"0\") field(DRVH, \"10\")";
  const Ioc ioc(longout("@s readback=7", limits) +
                "record(ao, \"a\") { field(DTYP, \"MPF\") "
                "field(OUT, \"@s type=int32 readback=7\") " +
                limits + " }\n");

  for (const std::string name : {"v", "a"}) {
    Ioc::waitFor(name + ".AMSG", "the value does not fit the record");
    EXPECT_EQ(Ioc::get(name), "4");
  }
}

TEST_F(GeneralOutputTest, AnMbboKeepsItsValueWhenAnUnknownStateIsReadBack) {
  const Register server(backplane_);
  const Ioc ioc(
      "record(mbbo, \"v\") { field(DTYP, \"MPF\") field(OUT, \"@s readback=7\") "
      "field(ZRVL, \"1\") field(ONVL, \"2\") field(ONST, \"one\") field(VAL, \"1\") }\n");

  Ioc::waitFor("v.AMSG", "the value does not fit the record");

  EXPECT_EQ(Ioc::get("v"), "one");
  EXPECT_EQ(Ioc::get("v.RVAL"), "2");
}

// A disabled record has the value that was read back, and its monitors get it.
TEST_F(GeneralOutputTest, ADisabledOutputPostsTheValueThatIsReadBack) {
  std::atomic<bool> isBusy = true;
  const ThreadServer server(backplane_, "s", [&](MessageServer& self, Message&& request) {
    while (isBusy) std::this_thread::yield();
    request.tryAs<Int32>()->value = 33;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(longout("@s readback=7", "field(DISV, \"0\")"));
  FieldMonitor monitor("v.VAL");
  static_cast<void>(monitor.takeMasks());

  isBusy = false;
  Ioc::waitFor("v", "33");

  EXPECT_THAT(monitor.takeMasks(), testing::Contains(DBE_VALUE | DBE_LOG));
  EXPECT_EQ(Ioc::get("v.UDF"), "0");
}

TEST_F(GeneralOutputTest, AnOutputReadsItsValueBackAtTheFirstConnection) {
  const Register server(backplane_);
  const Ioc ioc(longout("@s readback=7"));

  Ioc::waitFor("v", "33");

  EXPECT_EQ(Ioc::get("v.UDF"), "0");
  EXPECT_EQ(Ioc::get("v.SEVR"), "NO_ALARM");
  EXPECT_EQ(server.writes(), 0);

  ASSERT_EQ(Ioc::put("v", "34"), 0);
  while (server.value() != 34) std::this_thread::yield();
  EXPECT_EQ(server.writes(), 1);
}

TEST_F(GeneralOutputTest, EachOutputTypeCanBeReadBack) {
  const Register server(backplane_);
  const auto output = [](const std::string& type, const std::string& name,
                         const std::string& fields = "", const std::string& parameters = "") {
    return "record(" + type + ", \"" + name + "\") { field(DTYP, \"MPF\") field(OUT, \"@s " +
           parameters + " type=int32 readback=7\") " + fields + " }\n";
  };
  const Ioc ioc(output("ao", "ao", "field(LINR, \"SLOPE\") field(ESLO, \"2\")") +
                output("int64out", "int64out") +
                output("bo", "bo", "field(ONAM, \"on\")", "shift=5") +
                output("mbbo", "mbbo", "field(ONVL, \"33\") field(ONST, \"one\")") +
                output("mbboDirect", "direct") + output("stringout", "stringout") +
                output("lso", "lso", "field(SIZV, \"20\")"));

  Ioc::waitFor("ao", "66");
  Ioc::waitFor("int64out", "33");
  Ioc::waitFor("bo", "on");
  Ioc::waitFor("mbbo", "one");
  Ioc::waitFor("direct", "33");
  Ioc::waitFor("direct.B5", "1");
  Ioc::waitFor("stringout", "33");
  Ioc::waitFor("lso", "33");
  EXPECT_EQ(server.writes(), 0);
}

// The server is busy with the request of `first`, which is sent before the other.
TEST_F(GeneralOutputTest, AReadbackThatTheServerDidNotReceiveInTimeIsSentAgain) {
  std::atomic<bool> isBusy = true;
  const ThreadServer server(backplane_, "s", [&](MessageServer& self, Message&& request) {
    while (isBusy) std::this_thread::yield();
    request.tryAs<Int32>()->value = 33;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(
      "record(longin, \"first\") { field(DTYP, \"MPF\") field(INP, \"@s\") field(PINI, \"YES\") "
      "}\n" +
      longout("@s readback=7 timeout=0.01"));
  Ioc::waitFor("v.AMSG", "no reply in time");

  isBusy = false;

  Ioc::waitFor("v", "33");
  Ioc::waitFor("v.SEVR", "NO_ALARM");
}

TEST_F(GeneralOutputTest, AReadbackThatFailsIsAnAlarmUntilTheRecordWrites) {
  const ThreadServer server(backplane_, "s", [](MessageServer& self, Message&& request) {
    auto* fields = request.tryAs<Int32>();
    fields->status = fields->cmd == kReadBack ? -1 : 0;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(longout("@s readback=7"));
  Ioc::waitFor("v.STAT", "WRITE");

  ASSERT_EQ(Ioc::put("v", "1"), 0);

  Ioc::waitFor("v.SEVR", "NO_ALARM");
}

TEST_F(GeneralOutputTest, TheAlarmOfAReadbackThatFailsHasItsTime) {
  std::atomic<bool> isBusy = true;
  const ThreadServer server(backplane_, "s", [&](MessageServer& self, Message&& request) {
    while (isBusy) std::this_thread::yield();
    request.tryAs<Int32>()->status = -1;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(longout("@s readback=7"));
  epicsTimeStamp before;
  epicsTimeGetCurrent(&before);

  isBusy = false;
  Ioc::waitFor("v.STAT", "WRITE");

  const auto time = Ioc::timeOf("v");
  EXPECT_GE(epicsTimeDiffInSeconds(&time, &before), 0);
}

TEST_F(GeneralOutputTest, AnOutputWritesAgainAfterAReconnectionOnlyWhenTheLinkSaysSo) {
  for (const bool isRewriting : {false, true}) {
    SCOPED_TRACE(isRewriting);
    std::optional<Register> server(std::in_place, backplane_);
    const Ioc ioc(
        longout(isRewriting ? "@s rewrite=yes" : "@s", "field(VAL, \"5\") field(PINI, \"YES\")") +
        "record(longin, \"other\") { field(DTYP, \"MPF\") "
        "field(INP, \"@s cmd=7\") field(PINI, \"YES\") }\n");
    while (server->value() != 5) std::this_thread::yield();
    Ioc::waitFor("v.PACT", "0");

    server.reset();
    Ioc::waitFor("v.STAT", "COMM");
    Ioc::waitFor("other.STAT", "COMM");
    server.emplace(backplane_);

    Ioc::waitFor("other.SEVR", "NO_ALARM");  // connected, after v
    if (isRewriting) {
      Ioc::waitFor("v.SEVR", "NO_ALARM");
      EXPECT_EQ(server->value(), 5);
    } else {
      EXPECT_EQ(server->writes(), 0);
      EXPECT_EQ(Ioc::get("v.STAT"), "COMM");
    }
  }
}

// ---- longout with OOPT: a field of EPICS Base 7.0.8 and later

template <class Record>
constexpr bool kHasOption = requires(Record record) { record.oopt; };

class OutputOnChange : public GeneralOutputTest {
 protected:
  void SetUp() override {
    if (!kHasOption<longoutRecord>) GTEST_SKIP() << "this EPICS Base has no OOPT";
  }
  static std::string onChange(const std::string& link, const std::string& fields = "") {
    return longout(link, "field(OOPT, \"On Change\") " + fields) +
           "record(longin, \"other\") { field(DTYP, \"MPF\") "
           "field(INP, \"@s cmd=7\") field(PINI, \"YES\") }\n";
  }
  static constexpr const char* kFirst = "field(VAL, \"5\") field(PINI, \"YES\")";
};

TEST_F(OutputOnChange, GetsTheStatusOfItsWrite) {
  const ThreadServer server(backplane_, "s", [](MessageServer& self, Message&& request) {
    auto* fields = request.tryAs<Int32>();
    fields->status = fields->cmd == kReadBack ? 0 : -3;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(onChange("@s"));
  Ioc::waitFor("other.SEVR", "NO_ALARM");

  ASSERT_EQ(Ioc::put("v", "5"), 0);

  Ioc::waitFor("v.AMSG", "status -3 from the server");
  EXPECT_EQ(Ioc::get("v.STAT"), "WRITE");
  EXPECT_EQ(Ioc::get("v.OOPT"), "On Change");
}

TEST_F(OutputOnChange, IsWrittenAtTheFirstConnectionWhenPiniAsksForIt) {
  const Ioc ioc(onChange("@s", kFirst));
  Ioc::waitFor("v.STAT", "COMM");

  const Register server(backplane_);

  while (server.value() != 5) std::this_thread::yield();
  Ioc::waitFor("v.SEVR", "NO_ALARM");
}

TEST_F(OutputOnChange, WritesAgainAfterAReconnection) {
  std::optional<Register> server(std::in_place, backplane_);
  const Ioc ioc(onChange("@s rewrite=yes", kFirst));
  Ioc::waitFor("v.SEVR", "NO_ALARM");

  server.reset();
  Ioc::waitFor("v.STAT", "COMM");
  server.emplace(backplane_);

  while (server->value() != 5) std::this_thread::yield();
  Ioc::waitFor("v.SEVR", "NO_ALARM");
}

TEST_F(OutputOnChange, DoesNotWriteTheSameValueAgain) {
  const Register server(backplane_);
  const Ioc ioc(onChange("@s"));
  Ioc::waitFor("other.SEVR", "NO_ALARM");

  for (const char* value : {"5", "5", "6"}) {
    ASSERT_EQ(Ioc::put("v", value), 0);
    Ioc::waitFor("v.PACT", "0");
  }

  EXPECT_EQ(server.value(), 6);
  EXPECT_EQ(server.writes(), 2);
}

// The record processes again after the reply, with a value that was not sent before.
TEST_F(OutputOnChange, WritesAValueThatWasPutBeforeTheReply) {
  std::atomic<bool> isBusy = true;
  std::atomic<int> last = 0;
  const ThreadServer server(backplane_, "s", [&](MessageServer& self, Message&& request) {
    const auto* fields = request.tryAs<Int32>();
    while (fields->cmd != kReadBack && isBusy) std::this_thread::yield();
    last = fields->value;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(onChange("@s"));
  Ioc::waitFor("other.SEVR", "NO_ALARM");
  ASSERT_EQ(Ioc::put("v", "5"), 0);
  ASSERT_EQ(Ioc::put("v", "6"), 0);
  EXPECT_EQ(Ioc::get("v.PACT"), "1");

  isBusy = false;

  while (last != 6) std::this_thread::yield();
}

}  // namespace
}  // namespace mpf::test
