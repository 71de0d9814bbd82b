// SPDX-License-Identifier: MIT
// Each record type with DTYP "MPF", in an IOC, with a server.
#include <algorithm>
#include <initializer_list>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include <mpf/digital_io_commands.h>

#include "tests/epics/epics_fixture.h"

namespace mpf::test {
namespace {

using GeneralRecordTest = EpicsTest;

// Replies to a request of each type with a value of the same type.
void replyWithValue(MessageServer& self, Message&& request) {
  if (auto* integer = request.tryAs<Int32>()) integer->value = 0x1234;
  if (auto* number = request.tryAs<Float64>()) number->value = 2.5;
  if (request.tryAs<Int32Array>() != nullptr) {
    auto reply = self.allocReplyMessage<Int32Array>(request, 3);
    std::ranges::copy(std::initializer_list<std::int32_t>{1, -2, 3}, reply.value().begin());
    static_cast<void>(self.reply(std::move(reply)));
  } else if (request.tryAs<Float64Array>() != nullptr) {
    auto reply = self.allocReplyMessage<Float64Array>(request, 2);
    std::ranges::copy(std::initializer_list<double>{0.5, 1e10}, reply.value().begin());
    static_cast<void>(self.reply(std::move(reply)));
  } else if (request.tryAs<Char8Array>() != nullptr) {
    const std::string_view text = "12.5 V";
    auto reply = self.allocReplyMessage<Char8Array>(request, text.size());
    std::ranges::copy(text, reply.value().begin());
    static_cast<void>(self.reply(std::move(reply)));
  } else {
    static_cast<void>(self.reply(std::move(request)));
  }
}

std::string record(const std::string& type, const std::string& name, const std::string& link,
                   const std::string& fields = "") {
  const bool isOutput = type.ends_with("o") || type.ends_with("out") || type == "mbboDirect";
  return "record(" + type + ", \"" + name + "\") { field(DTYP, \"MPF\") field(" +
         (isOutput ? "OUT" : "INP") + ", \"@" + link + "\") " + fields + " }\n";
}
std::string readAtStart(const std::string& type, const std::string& name,
                        const std::string& parameters = "", const std::string& fields = "") {
  return record(type, name, "any " + parameters, "field(PINI, \"YES\") " + fields);
}

struct Expected {
  const char* field;
  const char* value;
};

TEST_F(GeneralRecordTest, EachInputRecordHasTheValueOfTheReply) {
  const ThreadServer server(backplane_, "any", replyWithValue);
  const Ioc ioc(
      readAtStart("ai", "ai", "", "field(PREC, \"2\")") +
      readAtStart("ai", "aiSlope", "", "field(PREC, \"1\") field(ASLO, \"2\") field(AOFF, \"1\")") +
      readAtStart("ai", "aiLinear", "type=int32 range=0:9320",
                  "field(LINR, \"LINEAR\") field(EGUL, \"-10\") field(EGUF, \"10\")") +
      readAtStart("ai", "aiText", "type=char8Array", "field(PREC, \"1\")") +
      readAtStart("longin", "longin") + readAtStart("longin", "longinRounded", "type=float64") +
      readAtStart("longin", "longinBits", "mask=0xff0 shift=4") +
      readAtStart("longin", "longinArray", "type=int32Array") + readAtStart("int64in", "int64in") +
      readAtStart("bi", "bi") + readAtStart("bi", "biClear", "shift=3") +
      readAtStart("bi", "biSet", "mask=0x10") +
      readAtStart("mbbi", "mbbi", "shift=4", "field(NOBT, \"4\")") +
      readAtStart("mbbi", "mbbiMask", "mask=0x200 shift=8",
                  "field(TWVL, \"2\") field(TWST, \"two\")") +
      readAtStart("mbbiDirect", "direct", "shift=8", "field(NOBT, \"8\")") +
      readAtStart("stringin", "stringin") +
      readAtStart("stringin", "stringNumber", "type=float64") +
      readAtStart("lsi", "lsi", "", "field(SIZV, \"100\")") +
      readAtStart("waveform", "wave", "", "field(FTVL, \"SHORT\") field(NELM, \"5\")") +
      readAtStart("waveform", "bytes", "", "field(FTVL, \"CHAR\") field(NELM, \"50\")") +
      readAtStart("aai", "aai", "", "field(FTVL, \"DOUBLE\") field(NELM, \"5\")") +
      readAtStart("event", "event"));

  for (const auto& [field, value] :
       {Expected{"ai", "2.50"},          Expected{"aiSlope", "6.0"},
        Expected{"aiLinear", "0"},       Expected{"aiText", "12.5"},
        Expected{"longin", "4660"},      Expected{"longinRounded", "3"},
        Expected{"longinBits", "35"},    Expected{"longinArray", "1"},
        Expected{"int64in", "4660"},     Expected{"bi.RVAL", "4660"},
        Expected{"biClear.RVAL", "0"},   Expected{"biSet.RVAL", "16"},
        Expected{"mbbi.RVAL", "48"},     Expected{"mbbiMask", "two"},
        Expected{"direct", "18"},        Expected{"direct.B1", "1"},
        Expected{"direct.B4", "1"},      Expected{"stringin", "12.5 V"},
        Expected{"stringNumber", "2.5"}, Expected{"lsi.LEN", "7"},
        Expected{"wave.NORD", "3"},      Expected{"bytes.NORD", "6"},
        Expected{"aai.NORD", "2"},       Expected{"event", "4660"}}) {
    SCOPED_TRACE(field);
    const auto name = std::string(field).substr(0, std::string(field).find('.'));
    Ioc::waitFor(name + ".SEVR", "NO_ALARM");
    EXPECT_EQ(Ioc::get(field), value);
  }
}

// The last message that each address of a server got, as text.
class Writes {
 public:
  void operator()(MessageServer& self, Message&& request) {
    {
      const std::lock_guard lock(mutex_);
      if (const auto* integer = request.tryAs<Int32>())
        written_[integer->address] = std::to_string(integer->value);
      if (const auto* number = request.tryAs<Float64>())
        written_[number->address] = std::to_string(number->value);
      const auto elements = request.valueAs<Int32Array>();
      if (const auto* array = request.tryAs<Int32Array>(); array != nullptr && !elements.empty())
        written_[array->address] =
            std::to_string(elements.size()) + ":" + std::to_string(elements.back());
      if (const auto* text = request.tryAs<Char8Array>()) {
        const auto bytes = request.valueAs<Char8Array>();
        written_[text->address] = std::string(bytes.begin(), bytes.end());
      }
    }
    static_cast<void>(self.reply(std::move(request)));
  }
  std::string at(std::int32_t address) {
    const std::lock_guard lock(mutex_);
    return written_[address];
  }

 private:
  std::mutex mutex_;
  std::map<std::int32_t, std::string> written_;
};

// What an output with these bits writes is read back as the same number.
TEST_F(GeneralRecordTest, AMaskThatSelectsTheSignKeepsIt) {
  const ThreadServer server(backplane_, "any", [](MessageServer& self, Message&& request) {
    request.tryAs<Int32>()->value = -2;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(readAtStart("longin", "longin", "mask=0xffffffff") +
                readAtStart("ai", "ai", "type=int32 mask=0xffffffff") +
                readAtStart("longin", "part", "mask=0xffff0000 shift=16") +
                readAtStart("int64in", "int64in", "mask=0xffffffff"));

  for (const auto& [field, value] :
       {Expected{"longin", "-2"}, Expected{"ai.RVAL", "-2"}, Expected{"part", "65535"},
        Expected{"int64in", "4294967294"}}) {
    SCOPED_TRACE(field);
    const auto name = std::string(field).substr(0, std::string(field).find('.'));
    Ioc::waitFor(name + ".SEVR", "NO_ALARM");
    EXPECT_EQ(Ioc::get(field), value);
  }
}

TEST_F(GeneralRecordTest, EachOutputRecordWritesItsValue) {
  Writes writes;
  const ThreadServer server(backplane_, "out", std::ref(writes));
  struct Output {
    const char* type;
    const char* parameters;
    const char* fields;
    const char* put;
    const char* written;
  };
  const std::vector<Output> outputs{
      {"ao", "", "", "2.5", "2.500000"},
      {"ao", "type=int32 range=0:4000",
       "field(LINR, \"LINEAR\") field(EGUL, \"-10\") field(EGUF, \"10\")", "5", "3000"},
      {"longout", "", "", "-7", "-7"},
      {"longout", "mask=0xff00 shift=8", "", "3", "768"},
      {"int64out", "type=float64", "", "4294967296", "4294967296.000000"},
      {"bo", "", "", "1", "1"},
      {"bo", "shift=5", "", "1", "32"},
      {"mbbo", "shift=4", "field(NOBT, \"4\") field(TWVL, \"9\") field(TWST, \"two\")", "two",
       "144"},
      {"mbboDirect", "shift=8", "field(NOBT, \"8\")", "255", "65280"},
      {"stringout", "", "", "on", "on"},
      {"stringout", "type=int32", "", "42", "42"},
      {"lso", "", "field(SIZV, \"90\")", "hello", "hello"},
      {"aao", "", "field(FTVL, \"LONG\") field(NELM, \"4\")", "6", "1:6"}};
  std::string database;
  for (std::size_t at = 0; at < outputs.size(); ++at)
    database += record(outputs[at].type, "o" + std::to_string(at),
                       "out address=" + std::to_string(at) + " " + outputs[at].parameters,
                       std::string("field(PINI, \"YES\") ") + outputs[at].fields);
  const Ioc ioc(database);

  for (std::size_t at = 0; at < outputs.size(); ++at) {
    const auto name = "o" + std::to_string(at);
    SCOPED_TRACE(std::string(outputs[at].type) + " " + outputs[at].parameters);
    while (Ioc::get(name + ".STAT") == "COMM" || Ioc::get(name + ".PACT") == "1")
      std::this_thread::yield();
    ASSERT_EQ(Ioc::put(name, outputs[at].put), 0);
    Ioc::waitFor(name + ".SEVR", "NO_ALARM");
    Ioc::waitFor(name + ".PACT", "0");
    EXPECT_EQ(writes.at(static_cast<std::int32_t>(at)), outputs[at].written);
  }
}

TEST_F(GeneralRecordTest, AnOutputThatDoesNotFitTheMessageOrTheBitsIsNotWritten) {
  Writes writes;
  const ThreadServer server(backplane_, "out", std::ref(writes));
  struct Output {
    const char* type;
    const char* parameters;
    const char* fields;
    const char* put;
    const char* status = "WRITE";
  };
  const std::vector<Output> outputs{
      {"ao", "type=int32", "", "1e12"},
      {"ao", "type=int32", "", "nan", "UDF"},
      {"ao", "type=int32 range=0:4000",
       "field(LINR, \"LINEAR\") field(EGUL, \"-10\") field(EGUF, \"10\")", "-1e9"},
      {"ao", "type=int32 mask=0xff", "", "256"},
      {"longout", "mask=0xff shift=4", "", "8191"},
      {"longout", "mask=0xff", "", "-1"},
      {"int64out", "shift=1", "", "4294967296"}};
  std::string database;
  for (std::size_t at = 0; at < outputs.size(); ++at)
    database += record(outputs[at].type, "o" + std::to_string(at),
                       "out address=" + std::to_string(at) + " " + outputs[at].parameters,
                       std::string("field(PINI, \"YES\") field(VAL, \"0\") ") + outputs[at].fields);
  const Ioc ioc(database);

  for (std::size_t at = 0; at < outputs.size(); ++at) {
    const auto name = "o" + std::to_string(at);
    SCOPED_TRACE(std::string(outputs[at].type) + " " + outputs[at].parameters);
    Ioc::waitFor(name + ".STAT", "NO_ALARM");
    Ioc::waitFor(name + ".PACT", "0");
    const auto written = writes.at(static_cast<std::int32_t>(at));
    static_cast<void>(Ioc::put(name, outputs[at].put));
    EXPECT_EQ(Ioc::get(name + ".STAT"), outputs[at].status);
    EXPECT_EQ(Ioc::get(name + ".SEVR"), "INVALID");
    EXPECT_EQ(Ioc::get(name + ".PACT"), "0");
    EXPECT_EQ(writes.at(static_cast<std::int32_t>(at)), written);
  }
}

// Other records than ai and ao would not convert the value.
TEST_F(GeneralRecordTest, ARangeIsRefusedWhereNothingIsConverted) {
  const std::string range = "type=int32 range=0:4095";
  const Ioc ioc(readAtStart("longin", "longin", range) + readAtStart("mbbi", "mbbi", range) +
                record("int64out", "int64out", "any " + range) +
                readAtStart("waveform", "wave", "range=0:4095", "field(FTVL, \"LONG\")"));

  for (const std::string name : {"longin", "mbbi", "int64out", "wave"}) {
    SCOPED_TRACE(name);
    EXPECT_EQ(Ioc::get(name + ".PACT"), "1");
    EXPECT_EQ(Ioc::get(name + ".AMSG"), "range=: use it in an ai or ao record");
  }
}

// mask= and shift= of records that have no bits.
TEST_F(GeneralRecordTest, BitsOfTextArraysAndFloatingPointNumbersAreRefused) {
  const Ioc ioc(
      readAtStart("ai", "ai", "mask=3") + readAtStart("ai", "text", "type=char8Array mask=3") +
      readAtStart("stringin", "string", "type=int32 shift=3") +
      readAtStart("waveform", "wave", "mask=3", "field(FTVL, \"LONG\")") +
      readAtStart("event", "event", "mask=3") + readAtStart("ai", "raw", "type=int32 mask=3") +
      readAtStart("longin", "number", "type=char8Array mask=3"));

  for (const std::string refused : {"ai", "text", "string", "wave", "event"})
    EXPECT_EQ(Ioc::get(refused + ".STAT"), "LINK") << refused;
  EXPECT_EQ(Ioc::get("raw.STAT"), "COMM");
  EXPECT_EQ(Ioc::get("number.STAT"), "COMM");
}

// The digital I/O server: polled, and with a monitor for each record.
TEST_F(GeneralRecordTest, MbbiDirectRecordsReadAndMonitorBitsOfDigitalInputs) {
  const ThreadServer server(backplane_, "c-UnidigIn", [](MessageServer& self, Message&& request) {
    auto* fields = request.tryAs<Int32>();
    if (fields->cmd == digital::cmdStartMonitor) {
      for (const int inputs : {0x120, 0x340}) {
        auto reply = self.allocReplyMessage<Int32>(request);
        reply->value = inputs;
        static_cast<void>(self.reply(std::move(reply)));
      }
      request.reset();
      return;
    }
    fields->value = 0x7f0 & fields->address;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(record("mbbiDirect", "polled", "c-UnidigIn cmd=7 address=0xff0 shift=4",
                       "field(NOBT, \"8\") field(PINI, \"YES\")") +
                record("mbbiDirect", "low", "c-UnidigIn cmd=3 shift=4",
                       "field(NOBT, \"4\") field(SCAN, \"I/O Intr\")") +
                record("mbbiDirect", "high", "c-UnidigIn cmd=3 mask=0xf00 shift=8",
                       "field(SCAN, \"I/O Intr\")"));

  Ioc::waitFor("polled", "127");
  Ioc::waitFor("low", "4");
  Ioc::waitFor("low.B2", "1");
  Ioc::waitFor("high", "3");
  EXPECT_EQ(Ioc::get("polled.SEVR"), "NO_ALARM");
}

TEST_F(GeneralRecordTest, AnEventRecordPostsTheEventThatTheServerNames) {
  const ThreadServer server(backplane_, "any", replyWithValue);
  const Ioc ioc(record("event", "event", "any type=char8Array", "field(SCAN, \"I/O Intr\")") +
                "record(calc, \"count\") { field(CALC, \"VAL+1\") field(SCAN, \"Event\") "
                "field(EVNT, \"12.5 V\") }");

  Ioc::waitFor("count", "1");
}

TEST_F(GeneralRecordTest, ALongerValueThanTheRecordIsAMinorAlarm) {
  const ThreadServer server(backplane_, "any", replyWithValue);
  const Ioc ioc(readAtStart("waveform", "wave", "", "field(FTVL, \"LONG\") field(NELM, \"2\")") +
                readAtStart("lsi", "lsi", "", "field(SIZV, \"16\")"));

  Ioc::waitFor("wave.SEVR", "MINOR");
  EXPECT_EQ(Ioc::get("wave.STAT"), "READ");
  EXPECT_EQ(Ioc::get("wave.NORD"), "2");
  Ioc::waitFor("lsi.SEVR", "NO_ALARM");
}

TEST_F(GeneralRecordTest, ArraysOfStringsAreRefused) {
  const Ioc ioc(readAtStart("waveform", "wave", "", "field(FTVL, \"STRING\") field(NELM, \"2\")"));

  EXPECT_EQ(Ioc::get("wave.PACT"), "1");
}

}  // namespace
}  // namespace mpf::test
