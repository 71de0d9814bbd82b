// SPDX-License-Identifier: MIT
// Device support whose functions throw exceptions: record support is C, and the IOC goes on.
#include <longinRecord.h>
#include <registryDeviceSupport.h>
#include <stdexcept>

#include <mpf/epics/dev_mpf.h>

#include "tests/epics/epics_fixture.h"

namespace mpf::test {
namespace {

std::atomic<const char*> throwsIn = "";  // the function that throws

class ThrowingDevice final : public DevMpf {
 public:
  explicit ThrowingDevice(dbCommon* record, DBLINK* link) : DevMpf(record, link) {}
  long startIO(dbCommon* /*record*/) override {
    throwIn("startIO");
    static_cast<void>(send(Int32Message({.value = 1}), replyTypeReceiveReply));
    return sendReply(Int32Message({.value = 7}));
  }
  long completeIO(dbCommon* /*record*/, Message&& /*message*/) override {
    throwIn("completeIO");
    return MPF_OK;
  }
  void receiveReply(dbCommon* /*record*/, Message&& /*message*/) override {
    throwIn("receiveReply");
  }
  long convert(dbCommon* /*record*/, int /*pass*/) override {
    throwIn("convert");
    return 0;
  }

 private:
  static void throwIn(const std::string& function) {
    if (function == throwsIn.load()) throw std::runtime_error("thrown in " + function);
  }
};

long initThrowing(dbCommon* record) {
  auto* device = new ThrowingDevice(record, &reinterpret_cast<longinRecord*>(record)->inp);
  device->bind();
  return device->getStatus();
}
MpfDset table{{6, nullptr, nullptr, initThrowing, DevMpf::getIoIntInfo},
              DevMpf::readWrite,
              DevMpf::linearConvert};

class ThrowingDeviceTest : public EpicsTest {
 protected:
  ThrowingDeviceTest() { registryDeviceSupportAdd("devThrowing", &table.common); }
  ~ThrowingDeviceTest() override { throwsIn = ""; }

  static constexpr const char* kDatabase = R"(
    device(longin, INST_IO, devThrowing, "Throwing")
    record(longin, "v") { field(DTYP, "Throwing") field(INP, "@adc") field(PINI, "YES") }
  )";
  std::atomic<int> requests_ = 0;
  const ThreadServer server_{backplane_, "adc", [&](MessageServer& self, Message&& request) {
                               ++requests_;
                               static_cast<void>(self.reply(std::move(request)));
                             }};
};

TEST_F(ThrowingDeviceTest, AnExceptionOfStartIOIsAReadAlarmWithItsText) {
  throwsIn = "startIO";
  const Ioc ioc(kDatabase);

  Ioc::waitFor("v.STAT", "READ");
  EXPECT_EQ(Ioc::get("v.AMSG"), "thrown in startIO");
  EXPECT_EQ(Ioc::get("v.PACT"), "0");

  throwsIn = "";
  EXPECT_EQ(Ioc::put("v.PROC", "1"), 0);
  Ioc::waitFor("v.SEVR", "NO_ALARM");
}

TEST_F(ThrowingDeviceTest, AnExceptionOfCompleteIOIsAReadAlarmWithItsText) {
  throwsIn = "completeIO";
  const Ioc ioc(kDatabase);

  Ioc::waitFor("v.STAT", "READ");
  EXPECT_EQ(Ioc::get("v.AMSG"), "thrown in completeIO");
  EXPECT_EQ(Ioc::get("v.PACT"), "0");
}

TEST_F(ThrowingDeviceTest, AfterAnExceptionOfReceiveReplyTheRecordGoesOn) {
  throwsIn = "receiveReply";
  const Ioc ioc(kDatabase);

  Ioc::waitFor("v.SEVR", "NO_ALARM");
  for (int round = 0; round < 3; ++round) {
    Ioc::waitFor("v.PACT", "0");
    const int before = requests_;
    EXPECT_EQ(Ioc::put("v.PROC", "1"), 0);
    while (requests_ < before + 2) std::this_thread::yield();
  }
  Ioc::waitFor("v.PACT", "0");
  EXPECT_EQ(Ioc::get("v.SEVR"), "NO_ALARM");
}

TEST_F(ThrowingDeviceTest, AnExceptionOfConvertRefusesTheChange) {
  const Ioc ioc(kDatabase);
  DBADDR address;
  ASSERT_EQ(dbNameToAddr("v", &address), 0);

  EXPECT_EQ(DevMpf::linearConvert(address.precord, 1), 0);
  throwsIn = "convert";
  EXPECT_NE(DevMpf::linearConvert(address.precord, 1), 0);
}

}  // namespace
}  // namespace mpf::test
