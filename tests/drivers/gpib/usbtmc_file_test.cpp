// SPDX-License-Identifier: MIT
#include "drivers/gpib/usbtmc_file.h"

#include <linux/usb/tmc.h>
#include <sys/ioctl.h>

#include <array>
#include <cerrno>
#include <gtest/gtest.h>

#include "tests/drivers/gpib/echo_instrument.h"
#include "tests/drivers/gpib/gpib_test_values.h"
#include "tests/support/temporary_folder.h"

namespace mpf::test {
namespace {

TEST(UsbtmcFile, ReturnsTheErrorsOfSystemCalls) {
  const TemporaryFolder folder;
  const auto absent = usbtmcDeviceFile(folder.file("absent"));

  EXPECT_EQ(absent->open(), -ENOENT);
  EXPECT_EQ(absent->write(raw("a")), -EBADF);
  EXPECT_EQ(absent->control(USBTMC_IOCTL_CLEAR, nullptr), -EBADF);
}

// A plain file takes the place of the device.
TEST(UsbtmcFile, MakesTheSystemCalls) {
  const TemporaryFolder folder;
  const auto file = usbtmcDeviceFile(folder.write("usbtmc0", "answer"));
  ASSERT_EQ(file->open(), 0);

  std::array<std::uint8_t, 100> bytes{};
  EXPECT_EQ(file->read(bytes), 6);
  EXPECT_EQ(textOf(std::span(bytes).first(6)), "answer");
  EXPECT_EQ(file->write(raw("1234")), 4);
  EXPECT_EQ(file->control(USBTMC_IOCTL_CLEAR, nullptr), -ENOTTY);
  EXPECT_EQ(file->pollServiceRequest(), 0);
  file->close();
  EXPECT_EQ(file->read(bytes), -EBADF);
}

}  // namespace
}  // namespace mpf::test
