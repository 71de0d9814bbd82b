// SPDX-License-Identifier: MIT
// Device support that was written for the original MPF: the manual's, unchanged, and one that
// implements all functions of DevMpf.
#include <aiRecord.h>
#include <future>
#include <registryDeviceSupport.h>

#include <mpf/epics/classic.h>

#include "tests/epics/epics_fixture.h"

// The table of the manual's source, examples/classic/devAiIp330Scan.cc, which is compiled with
// another name for it: mpf.dbd has a table of that name.
extern "C" dset* pvar_dset_devAiManual;  // NOLINT(readability-identifier-naming): of EPICS Base

namespace {

// Sends a request to the address 1 at each connection, and one to the address 2 when it processes.
class Probe : public DevMpf {
 public:
  explicit Probe(aiRecord* record)
      : DevMpf(reinterpret_cast<dbCommon*>(record), &record->inp, true) {}
  long startIO(dbCommon*) override {
    const auto status = send(request(2), replyTypeCompleteIO);
    if (sendsMore) send(request(3), replyTypeNone);
    return status;
  }
  long completeIO(dbCommon* common, Message* message) override {
    auto* record = reinterpret_cast<aiRecord*>(common);
    record->val = static_cast<Float64Message*>(message)->value;
    record->udf = FALSE;
    delete message;
    return MPF_NoConvert;
  }
  void connectIO(dbCommon* record, Message* message) override {
    if (static_cast<ConnectMessage*>(message)->status == connectYes) {
      ++connections;
      auto* greeting = request(1);
      greeting->setClientExtra(7);
      send(greeting, replyTypeReceiveReply);
      if (greetsTwice) {
        auto* other = new Int32Message;
        other->setClientExtra(7);
        send(other, replyTypeReceiveReply);
      }
    }
    DevMpf::connectIO(record, message);
  }
  void receiveReply(dbCommon*, Message* message) override {
    std::unique_ptr<Message> owned(message);
    if (!greetsTwice) return received.set_value(std::move(owned));
    static_cast<void>(owned->getType() == messageTypeFloat64 ? ++float64s : ++int32s);
  }
  void outOfBandIO(dbCommon*, OutOfBandMessage* message) override {
    outOfBand = message->value;
    delete message;
  }
  // NOLINTNEXTLINE(readability-identifier-naming): the manual's name
  static long dev_init(void* v) { return (new Probe(static_cast<aiRecord*>(v)))->getStatus(); }

  static inline std::promise<std::unique_ptr<Message>> received;
  static inline std::atomic<int> connections = 0;
  static inline std::atomic<int> outOfBand = 0;
  static inline std::atomic<bool> sendsMore = false;
  static inline std::atomic<bool> greetsTwice = false;  // counts what it receives for them
  static inline std::atomic<int> float64s = 0;
  static inline std::atomic<int> int32s = 0;

 private:
  static Message* request(int address) {
    auto* message = new Float64Message;
    message->address = address;
    return message;
  }
};

}  // namespace

MAKE_LINCONV_DSET(devAiProbe, Probe::dev_init)

namespace mpf::test {
namespace {

class ClassicDevMpfTest : public EpicsTest {
 protected:
  ClassicDevMpfTest() {
    registryDeviceSupportAdd("devAiManual", pvar_dset_devAiManual);
    registryDeviceSupportAdd("devAiProbe", pvar_dset_devAiProbe);
    Probe::received = {};
    Probe::connections = 0;
    Probe::outOfBand = 0;
    Probe::sendsMore = false;
    Probe::greetsTwice = false;
    Probe::float64s = 0;
    Probe::int32s = 0;
  }
  static std::string manual(const std::string& fields) {
    return "device(ai, VME_IO, devAiManual, \"manual\")\n"
           "record(ai, \"v\") { field(DTYP, \"manual\") field(PINI, \"YES\") " +
           fields + " }";
  }
  static std::string probe(const std::string& fields) {
    return "device(ai, VME_IO, devAiProbe, \"probe\")\n"
           "record(ai, \"v\") { field(DTYP, \"probe\") field(INP, \"#C0 S0 @device\") " +
           fields + " }";
  }
};

TEST_F(ClassicDevMpfTest, TheManualsDeviceSupportReadsItsChannelWithItsGain) {
  const ThreadServer server(backplane_, "adc", [](MessageServer& self, Message&& request) {
    auto* fields = request.tryAs<Int32>();
    fields->value = fields->address == 3 && fields->value == 2 ? 0xffff : 0;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(manual(R"(field(INP, "#C0 S3 @adc,2") field(LINR, "LINEAR")
                          field(EGUL, "0") field(EGUF, "5"))"));

  Ioc::waitFor("v.SEVR", "NO_ALARM");

  EXPECT_EQ(Ioc::get("v"), "5");
  EXPECT_EQ(Ioc::get("v.RVAL"), "65535");
  ASSERT_EQ(Ioc::put("v.EGUF", "10"), 0);  // convert()
  ASSERT_EQ(Ioc::put("v.PROC", "1"), 0);
  Ioc::waitFor("v", "10");
}

TEST_F(ClassicDevMpfTest, AReplyWithAStatusIsAnAlarm) {
  const ThreadServer server(backplane_, "adc", [](MessageServer& self, Message&& request) {
    request.tryAs<Int32>()->status = -1;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(manual(R"(field(INP, "#C0 S3 @adc"))"));

  Ioc::waitFor("v.STAT", "READ");
  EXPECT_EQ(Ioc::get("v.SEVR"), "INVALID");
}

TEST_F(ClassicDevMpfTest, ARequestWithoutAReplyIsAnAlarmAndLeavesNoRecordActive) {
  const ThreadServer server(backplane_, "adc", [](MessageServer&, Message&&) {});
  const Ioc ioc(manual(R"(field(INP, "#C0 S3 @adc"))"));

  Ioc::waitFor("v.AMSG", "the server refused the request");
  EXPECT_EQ(Ioc::get("v.PACT"), "0");
}

TEST_F(ClassicDevMpfTest, ARequestTimesOutAlsoWhenAFurtherMessageWasSent) {
  Probe::sendsMore = true;
  std::vector<Message> kept;
  const ThreadServer server(backplane_, "device", [&](MessageServer&, Message&& request) {
    kept.push_back(std::move(request));
  });
  const Ioc ioc(probe(R"(field(PINI, "YES"))"));

  Ioc::waitFor("v.STAT", "TIMEOUT");
  EXPECT_EQ(Ioc::get("v.PACT"), "0");
  kept.clear();
}

TEST_F(ClassicDevMpfTest, AnAbsentServerIsAnAlarmAndTheRecordRecovers) {
  const Ioc ioc(manual(R"(field(INP, "#C0 S3 @adc"))"));
  EXPECT_EQ(Ioc::get("v.STAT"), "COMM");

  const ThreadServer server(backplane_, "adc", [](MessageServer& self, Message&& request) {
    static_cast<void>(self.reply(std::move(request)));
  });

  Ioc::waitFor("v.SEVR", "NO_ALARM");
}

TEST_F(ClassicDevMpfTest, AnIllegalParameterDisablesTheRecord) {
  const Ioc ioc(manual(R"(field(INP, "#C0 S3 @adc,4"))"));

  EXPECT_EQ(Ioc::get("v.PACT"), "1");
}

TEST_F(ClassicDevMpfTest, RepliesReachTheFunctionThatTheRequestNames) {
  const ThreadServer server(backplane_, "device", [](MessageServer& self, Message&& request) {
    request.tryAs<Float64>()->value = 0.5;
    auto notice = self.allocReplyMessage<OutOfBand>(request);
    notice->value = 9;
    static_cast<void>(self.reply(std::move(request)));
    static_cast<void>(self.reply(std::move(notice)));
  });
  const Ioc ioc(probe("field(PINI, \"YES\") field(PREC, \"1\")"));

  const auto reply = Probe::received.get_future().get();

  EXPECT_EQ(static_cast<const ::Float64Message&>(*reply).address, 1);
  EXPECT_EQ(reply->getClientExtra(), 7);
  Ioc::waitFor("v", "0.5");
  while (Probe::outOfBand != 9) std::this_thread::yield();
  EXPECT_EQ(Probe::connections, 1);
}

TEST_F(ClassicDevMpfTest, ReceiveReplyGetsAMessageOfTheRequestsTypeWhenThereIsNoReply) {
  const ThreadServer server(backplane_, "device", [](MessageServer&, Message&&) {});
  const Ioc ioc(probe(""));

  const auto answer = Probe::received.get_future().get();

  ASSERT_EQ(answer->getType(), messageTypeFloat64);
  EXPECT_EQ(static_cast<const ::Float64Message&>(*answer).status, fateRefused);
  EXPECT_EQ(answer->getClientExtra(), 7);
}

TEST_F(ClassicDevMpfTest, RequestsWithOneClientExtraKeepTheirTypes) {
  Probe::greetsTwice = true;
  const ThreadServer server(backplane_, "device", [](MessageServer&, Message&&) {});
  const Ioc ioc(probe(""));

  while (Probe::float64s + Probe::int32s < 2) std::this_thread::yield();

  EXPECT_EQ(Probe::float64s, 1);
  EXPECT_EQ(Probe::int32s, 1);
}

TEST_F(ClassicDevMpfTest, ConnectWaitWaitsForTheServer) {
  const Ioc ioc(probe(""));
  DBADDR address;
  ASSERT_EQ(dbNameToAddr("v", &address), 0);
  auto& device = *static_cast<Probe*>(address.precord->dpvt);
  EXPECT_FALSE(device.connectWait(0.05));

  const ThreadServer server(backplane_, "device", [](MessageServer&, Message&&) {});

  EXPECT_TRUE(device.connectWait(600));
}

TEST_F(ClassicDevMpfTest, FurtherRepliesProcessTheRecord) {
  Message kept;
  const ThreadServer server(backplane_, "device", [&](MessageServer& self, Message&& request) {
    if (request.tryAs<Float64>()->address != 2) return;
    kept = std::move(request);
    for (const double value : {1.0, 2.0, 3.0}) {
      auto change = self.allocReplyMessage<Float64>(kept);
      change->value = value;
      static_cast<void>(self.reply(std::move(change)));
    }
  });
  const Ioc ioc(probe("field(PINI, \"YES\")"));

  Ioc::waitFor("v", "3");
  kept.reset();
}

TEST_F(ClassicDevMpfTest, ANoticeInPlaceOfAReplyEndsItsRequest) {
  Probe::greetsTwice = true;
  const ThreadServer server(backplane_, "device", [](MessageServer& self, Message&& request) {
    if (request.getType() != MessageType::float64) return;  // refuses it
    static_cast<void>(self.reply(self.allocReplyMessage<OutOfBand>(request)));
  });
  const Ioc ioc(probe(""));

  while (Probe::float64s + Probe::int32s == 0) std::this_thread::yield();

  EXPECT_EQ(Probe::int32s, 1) << "the type of the other request";
}

}  // namespace
}  // namespace mpf::test
