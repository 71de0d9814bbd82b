// SPDX-License-Identifier: MIT
#include "drivers/gpib/usbtmc_model.h"

#include <linux/usb/tmc.h>
#include <sys/ioctl.h>

#include <array>
#include <cerrno>
#include <gtest/gtest.h>

#include "drivers/gpib/meter_model.h"
#include "tests/drivers/gpib/echo_instrument.h"
#include "tests/drivers/gpib/gpib_test_values.h"

namespace mpf::test {
namespace {

class UsbtmcModelTest : public testing::Test {
 protected:
  UsbtmcModelTest() { EXPECT_EQ(model_.open(), 0); }
  int setTimeout(std::uint32_t timeoutMs) {
    return model_.control(USBTMC_IOCTL_SET_TIMEOUT, &timeoutMs);
  }
  std::uint8_t attributes() {
    std::uint8_t value = 0;
    EXPECT_EQ(model_.control(USBTMC_IOCTL_MSG_IN_ATTR, &value), 0);
    return value;
  }

  std::array<std::uint8_t, 100> bytes_{};
  UsbtmcModel model_{std::make_shared<MeterModel>()};
};

TEST_F(UsbtmcModelTest, PassesMessagesToTheInstrument) {
  EXPECT_EQ(model_.write(raw("ID?")), 3);

  EXPECT_EQ(model_.read(bytes_), 9);
  EXPECT_EQ(textOf(std::span(bytes_).first(9)), "HP3458A\r\n");
  EXPECT_EQ(attributes(), 1) << "end of message";
}

TEST_F(UsbtmcModelTest, AMessageHasNoEndWhenTheFileSaysSo) {
  std::uint8_t end = 0;
  EXPECT_EQ(model_.control(USBTMC_IOCTL_EOM_ENABLE, &end), 0);
  EXPECT_EQ(model_.write(raw("I")), 1);
  end = 1;
  EXPECT_EQ(model_.control(USBTMC_IOCTL_EOM_ENABLE, &end), 0);
  EXPECT_EQ(model_.write(raw("D?")), 2);

  EXPECT_EQ(model_.read(bytes_), 9);
}

TEST_F(UsbtmcModelTest, StopsAtAByteIfTheInstrumentCan) {
  usbtmc_termchar stopAt{'4', 1};
  EXPECT_EQ(model_.control(USBTMC_IOCTL_CONFIG_TERMCHAR, &stopAt), 0);
  EXPECT_EQ(model_.write(raw("ID?")), 3);
  EXPECT_EQ(model_.read(bytes_), 4);
  EXPECT_EQ(attributes(), 2) << "stopped at a byte";

  model_.haveCapabilities(UsbtmcModel::kAllCapabilities, false);
  EXPECT_EQ(model_.control(USBTMC_IOCTL_CONFIG_TERMCHAR, &stopAt), -EINVAL);
}

TEST_F(UsbtmcModelTest, HasTheTimeoutsOfTheKernel) {
  EXPECT_EQ(setTimeout(99), -EINVAL);
  EXPECT_EQ(setTimeout(100), 0);
  EXPECT_EQ(model_.write(raw("TRIG HOLD")), 9);

  EXPECT_EQ(model_.read(bytes_), -ETIMEDOUT);
}

TEST_F(UsbtmcModelTest, AnUnpluggedFileIsOfNoUse) {
  model_.unplug();
  EXPECT_EQ(model_.write(raw("ID?")), -ENODEV);
  EXPECT_EQ(model_.open(), -ENOENT);
  model_.plugIn();
  EXPECT_EQ(model_.write(raw("ID?")), -ENODEV);
  EXPECT_EQ(model_.open(), 0);
  EXPECT_EQ(model_.write(raw("ID?")), 3);
}

TEST_F(UsbtmcModelTest, RefusesWhatTheInstrumentCannotDo) {
  model_.haveCapabilities(0, true);
  std::uint8_t on = 1;
  EXPECT_EQ(model_.control(USBTMC488_IOCTL_REN_CONTROL, &on), -EINVAL);
  EXPECT_EQ(model_.control(USBTMC488_IOCTL_LOCAL_LOCKOUT, nullptr), -EINVAL);
  EXPECT_EQ(model_.control(USBTMC488_IOCTL_GOTO_LOCAL, nullptr), -EINVAL);
  EXPECT_EQ(model_.control(USBTMC_IOCTL_INDICATOR_PULSE, nullptr), -EBADRQC);
}

TEST_F(UsbtmcModelTest, NotesServiceRequests) {
  EXPECT_EQ(model_.pollServiceRequest(), 0);
  EXPECT_EQ(model_.write(raw("RQS 4;SRQ")), 9);
  EXPECT_EQ(model_.pollServiceRequest(), 1);
  std::uint8_t status = 0;
  EXPECT_EQ(model_.control(USBTMC488_IOCTL_READ_STB, &status), 0);
  EXPECT_NE(status & kGpibRequestsService, 0);
  EXPECT_EQ(model_.pollServiceRequest(), 0);
}

}  // namespace
}  // namespace mpf::test
