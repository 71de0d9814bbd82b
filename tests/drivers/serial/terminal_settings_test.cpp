// SPDX-License-Identifier: MIT
// The settings of a pseudo-terminal, which the kernel stores, but for parity and character size.
#include "drivers/serial/terminal_settings.h"

#include <gmock/gmock.h>
#include <utility>

#include "tests/support/pty.h"
#include "tests/support/temporary_folder.h"

namespace mpf::test {
namespace {

using std::chrono_literals::operator""ms;
using std::chrono_literals::operator""s;

class TerminalSettingsTest : public testing::Test {
 protected:
  static FileDescriptor openFile(const std::string& path) {
    return FileDescriptor(
        checkCall(::open(path.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC), "open", path));
  }

  TemporaryFolder folder_;
  Pty pty_{folder_.file("tty")};
  FileDescriptor line_ = openFile(folder_.file("tty"));
  FileDescriptor noTerminal_ = openFile("/dev/null");
};

TEST_F(TerminalSettingsTest, OfTheRawModePassBytesUnchangedAndMarkDamage) {
  auto cooked = pty_.settings();
  cooked.c_iflag = ICRNL | IXON | IGNBRK;
  cooked.c_oflag = OPOST | ONLCR;
  cooked.c_lflag = ICANON | ECHO | ISIG;
  cooked.c_cc[VMIN] = 0;
  cooked.c_cc[VTIME] = 7;
  ::cfsetspeed(&cooked, B19200);
  ASSERT_EQ(::tcsetattr(line_.get(), TCSANOW, &cooked), 0);

  EXPECT_EQ(terminal::tryMakeRaw(line_.get()), "");

  const auto raw = pty_.settings();
  EXPECT_EQ(raw.c_iflag, tcflag_t{INPCK | PARMRK});
  EXPECT_EQ(raw.c_oflag, 0U);
  EXPECT_EQ(raw.c_lflag, 0U);
  EXPECT_EQ(raw.c_cflag & (CREAD | CLOCAL), tcflag_t{CREAD | CLOCAL});
  EXPECT_EQ(raw.c_cc[VMIN], 1);
  EXPECT_EQ(raw.c_cc[VTIME], 0);
  EXPECT_EQ(::cfgetospeed(&raw), speed_t{B19200});
}

TEST_F(TerminalSettingsTest, HaveNamedSpeedsSetByTheirConstants) {
  const std::pair<int, speed_t> speeds[] = {
      {50, B50},         {110, B110},         {300, B300},         {1200, B1200},
      {9600, B9600},     {38400, B38400},     {115200, B115200},   {460800, B460800},
      {921600, B921600}, {1000000, B1000000}, {3000000, B3000000}, {4000000, B4000000}};
  for (const auto& [baud, constant] : speeds) {
    EXPECT_EQ(terminal::tryApply(line_.get(), {.baud = baud}), "");

    const auto settings = pty_.settings();

    EXPECT_EQ(::cfgetospeed(&settings), constant) << baud;
  }
}

TEST_F(TerminalSettingsTest, SetAndClearStopBitsAndFlowControl) {
  const auto flags = [&] { return pty_.settings().c_cflag & (CSTOPB | CRTSCTS); };
  EXPECT_EQ(terminal::tryApply(line_.get(), {.stopBits = 2, .flowControl = 'H'}), "");
  EXPECT_EQ(flags(), tcflag_t{CSTOPB | CRTSCTS});
  EXPECT_EQ(terminal::tryApply(line_.get(), {.stopBits = 1}), "");
  EXPECT_EQ(flags(), tcflag_t{CRTSCTS});

  EXPECT_EQ(terminal::tryApply(line_.get(), {.flowControl = 'N'}), "");

  EXPECT_EQ(flags(), 0U);
}

TEST_F(TerminalSettingsTest, AreAllAppliedOrNone) {
  ASSERT_EQ(terminal::tryApply(line_.get(), {.baud = 9600, .stopBits = 1}), "");

  EXPECT_EQ(terminal::tryApply(line_.get(), {.baud = 19200, .stopBits = 2, .bitsPerChar = 7}),
            "the line does not accept bits per character 7: it keeps 8");
  EXPECT_EQ(terminal::tryApply(line_.get(), {.baud = 19200, .parity = 'O'}),
            "the line does not accept parity O: it keeps N");

  const auto settings = pty_.settings();
  EXPECT_EQ(::cfgetospeed(&settings), speed_t{B9600});
  EXPECT_EQ(settings.c_cflag & CSTOPB, 0U);
}

TEST_F(TerminalSettingsTest, GiveTheTimeThatBytesNeed) {
  ASSERT_EQ(terminal::tryApply(line_.get(), {.baud = 9600, .stopBits = 1}), "");
  EXPECT_EQ(terminal::timeFor(line_.get(), 960), 1s);
  EXPECT_EQ(terminal::timeFor(line_.get(), 0), 0s);
  ASSERT_EQ(terminal::tryApply(line_.get(), {.baud = 110, .stopBits = 2}), "");
  EXPECT_EQ(terminal::timeFor(line_.get(), 10), 1s) << "11 bits each";
  ASSERT_EQ(terminal::tryApply(line_.get(), {.stopBits = 1}), "");

  EXPECT_EQ(terminal::tryApply(line_.get(), {.baud = 250'000}), "") << "a speed without a constant";

  EXPECT_EQ(terminal::timeFor(line_.get(), 100), 4ms);
}

TEST_F(TerminalSettingsTest, NameTheCallThatFails) {
  constexpr const char* kProblem = "TCGETS2: Inappropriate ioctl for device";
  EXPECT_EQ(terminal::tryMakeRaw(noTerminal_.get()), kProblem);
  EXPECT_EQ(terminal::tryApply(noTerminal_.get(), {.baud = 9600}), kProblem);
  EXPECT_EQ(terminal::tryApply(noTerminal_.get(), {}), "") << "nothing to apply";
  EXPECT_EQ(terminal::timeFor(noTerminal_.get(), 100), 0s);
}

}  // namespace
}  // namespace mpf::test
