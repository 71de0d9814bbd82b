// SPDX-License-Identifier: MIT
#include "drivers/gpib/linux_gpib_controller.h"

#include <array>
#include <cerrno>
#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <stdexcept>
#include <string>

#include <mpf/drivers/gpib/linux_gpib.h>

#include "tests/drivers/gpib/echo_instrument.h"
#include "tests/drivers/gpib/fake_libgpib.h"
#include "tests/drivers/gpib/gpib_test_values.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;

// The library that LinuxGpibController loads, under the control of the test.
class FakeLibrary {
 public:
  FakeLibrary() : handle_(::dlopen(MPF_TEST_FAKE_LIBGPIB, RTLD_NOW)) {
    if (handle_ == nullptr) throw std::runtime_error(::dlerror());
    function<decltype(fakeGpibReset)>("fakeGpibReset")();
  }
  ~FakeLibrary() { ::dlclose(handle_); }
  FakeLibrary(const FakeLibrary&) = delete;
  FakeLibrary& operator=(const FakeLibrary&) = delete;

  void attach(const GpibAddress& address, GpibInstrumentModel& instrument) const {
    function<decltype(fakeGpibAttach)>("fakeGpibAttach")(
        address.primary, address.secondary ? *address.secondary : -1, &instrument);
  }
  void fail(const char* name, LibGpib::Error error, int count = 0, int calls = 1) const {
    function<decltype(fakeGpibFail)>("fakeGpibFail")(name, static_cast<int>(error), count, calls);
  }
  void monitorLines(bool on) const {
    function<decltype(fakeGpibMonitorLines)>("fakeGpibMonitorLines")(on);
  }
  [[nodiscard]] int interfaceClears() const {
    return function<decltype(fakeGpibInterfaceClears)>("fakeGpibInterfaceClears")();
  }

 private:
  template <class Function>
  [[nodiscard]] Function* function(const char* name) const {
    return reinterpret_cast<Function*>(::dlsym(handle_, name));
  }
  void* handle_;
};

class LinuxGpibControllerTest : public testing::Test {
 protected:
  LinuxGpibControllerTest() {
    library_.attach(kEcho, echo_);
    library_.attach(kOther, other_);
  }
  void write(const GpibAddress& to, std::string_view text) {
    const auto result = controller_->write(to, raw(text), true, patient());
    EXPECT_TRUE(result.ok()) << result.reason;
  }
  GpibReadResult read(const GpibAddress& from, const GpibReadLimits& limits = kUntilEnd) {
    auto result = controller_->read(from, limits, patient());
    EXPECT_TRUE(result.ok()) << result.reason;
    return result;
  }
  void expectWorks() {
    write(kOther, "works");
    EXPECT_EQ(textOf(read(kOther).data), "works");
  }

  EchoInstrument echo_;
  EchoInstrument other_;
  FakeLibrary library_;
  std::unique_ptr<GpibController> controller_ = openLinuxGpib({.library = MPF_TEST_FAKE_LIBGPIB});
};

TEST_F(LinuxGpibControllerTest, EveryByteValuePassesBothWays) {
  write(kEcho, everyByte());
  const auto answer = read(kEcho);

  EXPECT_EQ(textOf(answer.data), everyByte());
  EXPECT_TRUE(answer.sawEnd);
}

TEST_F(LinuxGpibControllerTest, AMebibytePassesBothWays) {
  const auto sent = manyBytes(1 << 20);
  write(kEcho, sent);
  EXPECT_TRUE(textOf(read(kEcho).data) == sent);
}

TEST_F(LinuxGpibControllerTest, AddressesInstrumentsWithSecondaryAddresses) {
  write(kOther, "other");
  write(kEcho, "echo");

  EXPECT_EQ(textOf(read(kOther).data), "other");
  EXPECT_EQ(textOf(read(kEcho).data), "echo");
}

TEST_F(LinuxGpibControllerTest, AWriteWithoutEndIsContinuedByTheNext) {
  EXPECT_TRUE(controller_->write(kEcho, raw("ab"), false, patient()).ok());
  EXPECT_TRUE(controller_->write(kEcho, {}, true, patient()).ok());
  EXPECT_EQ(echo_.ends, 0);
  write(kEcho, "cd");
  EXPECT_EQ(textOf(read(kEcho).data), "abcd");
}

TEST_F(LinuxGpibControllerTest, StopsAtTheCountAndAtTheEndOfString) {
  write(kEcho, "12;345");

  const auto first = read(kEcho, {.maxBytes = 1});
  EXPECT_EQ(textOf(first.data), "1");
  EXPECT_FALSE(first.sawEnd);
  EXPECT_EQ(textOf(read(kEcho, {.maxBytes = 100, .endOfString = ';'}).data), "2;");
  const auto last = read(kEcho, {.maxBytes = 100, .endOfString = ';'});
  EXPECT_EQ(textOf(last.data), "345");
  EXPECT_TRUE(last.sawEnd);
}

TEST_F(LinuxGpibControllerTest, ASilentInstrumentTimesOutWithItsBytes) {
  echo_.sendsEnd = false;
  withLaterDeadlines([&](Deadline deadline) {
    write(kEcho, "abc");
    const auto answer = controller_->read(kEcho, kUntilEnd, deadline);
    EXPECT_EQ(answer.status, GpibStatus::timeout);
    return textOf(answer.data) == "abc";
  });
  expectWorks();
}

TEST_F(LinuxGpibControllerTest, AnInstrumentThatAcceptsNothingTimesOut) {
  echo_.acceptsBytes = false;
  EXPECT_EQ(controller_->write(kEcho, raw("a"), true, soon()).status, GpibStatus::timeout);
  expectWorks();
}

TEST_F(LinuxGpibControllerTest, AnAbsentInstrumentIsNoListener) {
  const auto result = controller_->write(kAbsent, raw("a"), true, patient());

  EXPECT_EQ(result.status, GpibStatus::noListener);
  EXPECT_THAT(result.reason, HasSubstr("check the address"));
  expectWorks();
}

TEST_F(LinuxGpibControllerTest, AnOperationAfterItsDeadlineSendsNothing) {
  const auto late = Deadline::atNs(0);
  EXPECT_EQ(controller_->write(kEcho, raw("a"), true, late).status, GpibStatus::timeout);
  EXPECT_EQ(controller_->read(kEcho, kUntilEnd, late).status, GpibStatus::timeout);
  EXPECT_EQ(echo_.takeReceived(), "");
}

TEST_F(LinuxGpibControllerTest, PollsAndSeesServiceRequests) {
  EXPECT_EQ(controller_->requestsService(patient()), false);
  other_.wantsService = true;

  EXPECT_EQ(controller_->requestsService(patient()), true);
  EXPECT_EQ(controller_->serialPoll(kOther, patient()).statusByte, 0x41);
  EXPECT_EQ(controller_->serialPoll(kEcho, patient()).statusByte, 0x01);
  EXPECT_EQ(controller_->serialPoll(kAbsent, soon()).status, GpibStatus::timeout);
  EXPECT_EQ(controller_->requestsService(patient()), false);
  library_.monitorLines(false);
  EXPECT_EQ(controller_->requestsService(patient()), std::nullopt);
  EXPECT_FALSE(controller_->onServiceRequest([] {}));
  expectWorks();
}

TEST_F(LinuxGpibControllerTest, ClearsTriggersAndSetsControl) {
  using Control = GpibInstrumentModel::Control;
  const std::array both{kEcho, kOther};

  EXPECT_TRUE(controller_->interfaceClear(patient()).ok());
  EXPECT_TRUE(controller_->remoteEnable(true, patient()).ok());
  EXPECT_EQ(echo_.control, Control::remote);
  EXPECT_TRUE(controller_->localLockout(patient()).ok());
  EXPECT_EQ(other_.control, Control::remoteWithLockout);
  EXPECT_TRUE(controller_->goToLocal(kOther, patient()).ok());
  EXPECT_EQ(other_.control, Control::local);
  EXPECT_EQ(echo_.control, Control::remoteWithLockout);
  EXPECT_TRUE(controller_->clearAll(patient()).ok());
  EXPECT_TRUE(controller_->clear(kEcho, patient()).ok());
  EXPECT_TRUE(controller_->trigger(both, patient()).ok());

  EXPECT_EQ(echo_.clears, 2);
  EXPECT_EQ(other_.clears, 1);
  EXPECT_EQ(echo_.triggers, 1);
  EXPECT_EQ(other_.triggers, 1);
}

TEST_F(LinuxGpibControllerTest, ShowsCommandsAndDataToAPeekHandler) {
  std::string seen;
  controller_->onPeek([&](std::span<const GpibPeekedByte> bytes) {
    for (const auto& byte : bytes) {
      seen += byte.attention ? '!' : byte.direction == GpibDirection::sent ? '>' : '<';
      seen += static_cast<char>(byte.value);
      if (byte.endOrIdentify) seen += '.';
    }
  });
  write(kEcho, "a");
  read(kEcho);

  EXPECT_EQ(seen,
            "!_!?!C!6>a.!_!?"
            "!_!?!V!#<a.!_!?");
}

TEST_F(LinuxGpibControllerTest, EachErrorIsAStatusAndTheNextOperationWorks) {
  using Error = LibGpib::Error;
  for (const auto* const function : {"ibcmd", "ibwrt", "ibrd"}) {
    for (const auto error : {Error::systemCall, Error::notController, Error::noListener,
                             Error::notSystemController, Error::aborted, Error::noBoard}) {
      library_.fail(function, error, ENODEV);
      auto result = controller_->write(kEcho, raw("a"), true, patient());
      if (result.ok()) result = controller_->read(kEcho, {.maxBytes = 1}, patient());
      // A read that was interrupted once goes on.
      const bool mayContinue = std::string_view(function) == "ibrd" && error == Error::aborted;
      EXPECT_EQ(result.ok(), mayContinue) << function;
      expectWorks();
    }
  }
}

TEST_F(LinuxGpibControllerTest, SaysThatTheBoardIsAbsent) {
  library_.fail("ibsic", LibGpib::Error::noBoard);
  EXPECT_THAT(controller_->interfaceClear(patient()).reason,
              HasSubstr("board 0 (/dev/gpib0): IFC: no such board"));
  library_.fail("ibsre", LibGpib::Error::systemCall, EACCES);
  EXPECT_THAT(controller_->remoteEnable(true, patient()).reason, HasSubstr("Permission denied"));
}

TEST_F(LinuxGpibControllerTest, SaysThatTheAddressOfTheBoardHasChanged) {
  library_.fail("ibask", LibGpib::Error::noBoard);
  const auto early = openLinuxGpib({.library = MPF_TEST_FAKE_LIBGPIB});

  EXPECT_THAT(early->write(kEcho, raw("a"), true, patient()).reason, HasSubstr("open it again"));

  expectWorks();
}

TEST_F(LinuxGpibControllerTest, ClearsABusThatStaysBusyAfterAFailure) {
  library_.fail("ibcmd", LibGpib::Error::aborted, 0, 2);

  EXPECT_FALSE(controller_->write(kEcho, raw("a"), true, patient()).ok());

  EXPECT_EQ(library_.interfaceClears(), 1);
  expectWorks();
}

TEST(LinuxGpibController, RefusesNumbersThatNoBoardHas) {
  for (const int board : {-1, 16})
    EXPECT_THROW(static_cast<void>(openLinuxGpib({.board = board})), std::invalid_argument);
}

}  // namespace
}  // namespace mpf::test
