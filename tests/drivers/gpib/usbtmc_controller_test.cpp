// SPDX-License-Identifier: MIT
#include "drivers/gpib/usbtmc_controller.h"

#include <linux/usb/tmc.h>

#include <array>
#include <cerrno>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <string>

#include <mpf/drivers/gpib/usbtmc.h>

#include "drivers/gpib/usbtmc_model.h"
#include "tests/drivers/gpib/echo_instrument.h"
#include "tests/drivers/gpib/gpib_test_values.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;

class UsbtmcControllerTest : public testing::Test {
 protected:
  UsbtmcControllerTest() {
    auto model = std::make_unique<UsbtmcModel>(echo_);
    model_ = model.get();
    controller_ = std::make_unique<UsbtmcController>("/dev/usbtmc0", std::move(model));
  }
  void write(std::string_view text) {
    const auto result = controller_->write(kEcho, raw(text), true, patient());
    EXPECT_TRUE(result.ok()) << result.reason;
  }
  std::string read(const GpibReadLimits& limits = kUntilEnd) {
    const auto result = controller_->read(kEcho, limits, patient());
    EXPECT_TRUE(result.ok()) << result.reason;
    return textOf(result.data);
  }
  void expectWorks() {
    write("works");
    EXPECT_EQ(read(), "works");
  }

  std::shared_ptr<EchoInstrument> echo_ = std::make_shared<EchoInstrument>();
  UsbtmcModel* model_ = nullptr;
  std::unique_ptr<UsbtmcController> controller_;
};

TEST_F(UsbtmcControllerTest, EveryByteValuePassesBothWays) {
  write(everyByte());

  const auto answer = controller_->read(kEcho, kUntilEnd, patient());

  EXPECT_EQ(textOf(answer.data), everyByte());
  EXPECT_TRUE(answer.sawEnd);
}

TEST_F(UsbtmcControllerTest, AMebibytePassesBothWays) {
  const auto sent = manyBytes(1 << 20);
  write(sent);
  EXPECT_TRUE(read() == sent);
}

TEST_F(UsbtmcControllerTest, EachAddressMeansTheOneInstrument) {
  EXPECT_TRUE(controller_->write(kOther, raw("a"), true, patient()).ok());
  EXPECT_EQ(read(), "a");
}

TEST_F(UsbtmcControllerTest, AWriteWithoutEndIsContinuedByTheNext) {
  EXPECT_TRUE(controller_->write(kEcho, raw("ab"), false, patient()).ok());
  EXPECT_EQ(echo_->ends, 0);
  write("cd");
  EXPECT_EQ(read(), "abcd");
}

TEST_F(UsbtmcControllerTest, StopsAtTheCountAndAtTheEndOfString) {
  for (const bool stopsAtByte : {true, false}) {
    model_->haveCapabilities(UsbtmcModel::kAllCapabilities, stopsAtByte);
    write("12;345");
    EXPECT_EQ(read({.maxBytes = 1}), "1");
    EXPECT_EQ(read({.maxBytes = 100, .endOfString = ';'}), "2;");
    EXPECT_EQ(read(), "345");
  }
}

TEST_F(UsbtmcControllerTest, ASilentInstrumentTimesOutAndTheNextOperationWorks) {
  echo_->isSilent = true;

  withLaterDeadlines([&](Deadline deadline) {
    const auto answer = controller_->read(kEcho, kUntilEnd, deadline);
    EXPECT_EQ(answer.status, GpibStatus::timeout);
    return answer.reason.find("/dev/usbtmc0") != std::string::npos;
  });
  echo_->isSilent = false;
  expectWorks();
}

TEST_F(UsbtmcControllerTest, AnInstrumentThatAcceptsNothingTimesOut) {
  echo_->acceptsBytes = false;
  EXPECT_EQ(controller_->write(kEcho, raw("a"), true, soon()).status, GpibStatus::timeout);
  echo_->acceptsBytes = true;
  expectWorks();
}

TEST_F(UsbtmcControllerTest, APartOfAnAnswerTimesOutWithItsBytes) {
  echo_->sendsEnd = false;
  withLaterDeadlines([&](Deadline deadline) {
    write("abc");
    const auto answer = controller_->read(kEcho, kUntilEnd, deadline);
    EXPECT_EQ(answer.status, GpibStatus::timeout);
    return textOf(answer.data) == "abc";
  });
}

TEST_F(UsbtmcControllerTest, AnOperationAfterItsDeadlineSendsNothing) {
  const auto late = Deadline::atNs(0);
  EXPECT_EQ(controller_->write(kEcho, raw("a"), true, late).status, GpibStatus::timeout);
  EXPECT_EQ(echo_->takeReceived(), "");
}

TEST_F(UsbtmcControllerTest, AnUnpluggedInstrumentIsOpenedAgain) {
  expectWorks();
  model_->unplug();

  EXPECT_EQ(controller_->write(kEcho, raw("a"), true, patient()).status, GpibStatus::failure);
  const auto absent = controller_->interfaceClear(patient());
  EXPECT_EQ(absent.status, GpibStatus::failure);
  EXPECT_THAT(absent.reason, HasSubstr("plug the instrument in"));
  EXPECT_EQ(controller_->requestsService(patient()), std::nullopt);

  model_->plugIn();
  expectWorks();
}

TEST_F(UsbtmcControllerTest, EachErrorOfTheKernelIsAStatusAndTheNextOperationWorks) {
  expectWorks();
  for (const int error : {EIO, EPIPE, EPROTO, ETIMEDOUT, EPERM}) {
    model_->failOnce(error);
    const auto result = controller_->write(kEcho, raw("a"), true, patient());
    EXPECT_EQ(result.status, error == ETIMEDOUT ? GpibStatus::timeout : GpibStatus::failure);
    expectWorks();
    model_->failOnce(error);
    EXPECT_FALSE(controller_->read(kEcho, kUntilEnd, patient()).ok());
    expectWorks();
  }
}

TEST_F(UsbtmcControllerTest, AnOldKernelIsNamed) {
  model_->failOnce(EBADRQC);
  EXPECT_THAT(controller_->interfaceClear(patient()).reason, HasSubstr("4.20"));
  expectWorks();
}

TEST_F(UsbtmcControllerTest, PollsAndSeesServiceRequests) {
  EXPECT_EQ(controller_->requestsService(patient()), false);
  echo_->wantsService = true;

  EXPECT_EQ(controller_->requestsService(patient()), true);
  EXPECT_EQ(controller_->serialPoll(kEcho, patient()).statusByte, 0x41);
  EXPECT_EQ(controller_->requestsService(patient()), false);
  EXPECT_FALSE(controller_->onServiceRequest([] {}));
}

TEST_F(UsbtmcControllerTest, ClearsTriggersAndSetsControl) {
  using Control = GpibInstrumentModel::Control;
  const std::array one{kEcho};

  EXPECT_TRUE(controller_->remoteEnable(true, patient()).ok());
  EXPECT_EQ(echo_->control, Control::remote);
  EXPECT_TRUE(controller_->localLockout(patient()).ok());
  EXPECT_EQ(echo_->control, Control::remoteWithLockout);
  EXPECT_TRUE(controller_->goToLocal(kEcho, patient()).ok());
  EXPECT_EQ(echo_->control, Control::local);
  EXPECT_TRUE(controller_->trigger(one, patient()).ok());
  EXPECT_TRUE(controller_->clearAll(patient()).ok());
  EXPECT_TRUE(controller_->clear(kEcho, patient()).ok());
  EXPECT_TRUE(controller_->interfaceClear(patient()).ok());

  EXPECT_EQ(echo_->triggers, 1);
  EXPECT_EQ(echo_->clears, 2);
}

TEST_F(UsbtmcControllerTest, SaysWhatTheInstrumentCannotDo) {
  model_->haveCapabilities(0, false);
  const std::array one{kEcho};

  for (const auto& result :
       {controller_->trigger(one, patient()), controller_->localLockout(patient()),
        controller_->goToLocal(kEcho, patient()), controller_->remoteEnable(false, patient()),
        controller_->sendCommands(raw("\x14"), patient())})
    EXPECT_EQ(result.status, GpibStatus::unsupported);
  EXPECT_TRUE(controller_->remoteEnable(true, patient()).ok());
}

TEST_F(UsbtmcControllerTest, ShowsTheDataToAPeekHandler) {
  std::string seen;
  controller_->onPeek([&](std::span<const GpibPeekedByte> bytes) {
    for (const auto& byte : bytes) {
      seen += byte.direction == GpibDirection::sent ? '>' : '<';
      seen += static_cast<char>(byte.value);
      if (byte.endOrIdentify) seen += '.';
    }
  });
  write("ab");
  read();

  EXPECT_EQ(seen, ">a>b.<a<b.");
}

TEST(UsbtmcController, SaysThatADeviceIsAbsent) {
  const auto controller = openUsbtmc({.device = "/dev/absent"});

  const auto result = controller->interfaceClear(patient());

  EXPECT_EQ(result.status, GpibStatus::failure);
  EXPECT_THAT(result.reason, HasSubstr("/dev/absent: open: No such file or directory"));
}

}  // namespace
}  // namespace mpf::test
