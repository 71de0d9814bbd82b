// SPDX-License-Identifier: MIT
#include "drivers/serial/terminal_line.h"

#include <sys/file.h>
#include <sys/ioctl.h>

#include <gmock/gmock.h>
#include <stdexcept>

#include "tests/drivers/serial/line_collector.h"
#include "tests/support/pty.h"
#include "tests/support/temporary_folder.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

using OpenState = SerialLine::OpenState;

// The thread of the test is the port's thread.
class TerminalLineTest : public testing::Test {
 protected:
  FileDescriptor openDevice() const {
    return FileDescriptor(
        checkCall(::open(device_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC), "open", device_));
  }
  void arrive(std::string_view bytes) const {
    checkCall(::write(pty_->master().get(), bytes.data(), bytes.size()), "write");
    waitFor(POLLIN);
  }
  // Waits for `events` of the line, or for a hang-up.
  void waitFor(int events) const {
    pollfd ready{line_.waitsFor().fd, static_cast<short>(events), 0};
    ASSERT_EQ(::poll(&ready, 1, -1), 1);
  }
  static bool isExclusive(const FileDescriptor& device) {
    int exclusive = 0;
    checkCall(::ioctl(device.get(), TIOCGEXCL, &exclusive), "TIOCGEXCL");
    return exclusive != 0;
  }
  speed_t speed() const {
    const auto settings = pty_->settings();
    return ::cfgetospeed(&settings);
  }

  Watchdog watchdog_{"terminal line test"};
  TemporaryFolder folder_;
  const std::string device_ = folder_.file("tty");
  std::optional<Pty> pty_{device_};
  TerminalLine line_{device_, {.baud = 19200}};
};

TEST_F(TerminalLineTest, OpensTheDeviceExclusivelyWithItsSettings) {
  const auto other = openDevice();
  ASSERT_FALSE(isExclusive(other));

  EXPECT_EQ(line_.tryOpen(), OpenState::open);

  EXPECT_EQ(speed(), speed_t{B19200});
  EXPECT_TRUE(isExclusive(other));
  EXPECT_EQ(::flock(other.get(), LOCK_EX | LOCK_NB), -1);
  line_.close();
  EXPECT_FALSE(isExclusive(other));
  EXPECT_EQ(::flock(other.get(), LOCK_EX | LOCK_NB), 0);
  EXPECT_EQ(line_.waitsFor().fd, -1);
}

TEST_F(TerminalLineTest, LeavesADeviceUnchangedThatAnotherProgramUses) {
  const auto other = openDevice();
  ASSERT_EQ(::flock(other.get(), LOCK_EX | LOCK_NB), 0);
  const auto before = speed();

  EXPECT_EQ(line_.tryOpen(), OpenState::failed);

  EXPECT_EQ(line_.problem(), "open " + device_ + ": in use by another program");
  EXPECT_EQ(line_.waitsFor().fd, -1);
  EXPECT_EQ(speed(), before);
  EXPECT_FALSE(isExclusive(other));
}

TEST_F(TerminalLineTest, NamesTheReasonForWhichItCannotBeOpened) {
  TerminalLine absent(folder_.file("absent"), {});
  EXPECT_EQ(absent.tryOpen(), OpenState::failed);
  EXPECT_EQ(absent.problem(), "open " + folder_.file("absent") + ": No such file or directory");

  TerminalLine noTerminal("/dev/null", {});
  EXPECT_EQ(noTerminal.tryOpen(), OpenState::failed);
  EXPECT_EQ(noTerminal.problem(), "open /dev/null: not a terminal");

  TerminalLine refused(device_, {.bitsPerChar = 7});
  EXPECT_EQ(refused.tryOpen(), OpenState::failed);
  EXPECT_THAT(refused.problem(), HasSubstr("does not accept bits per character 7"));
  EXPECT_EQ(line_.tryOpen(), OpenState::open) << "the failed attempt has closed the device";

  EXPECT_THAT([&] { const TerminalLine invalid(device_, {.stopBits = 5}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr(device_ + ": ")));
}

// Another program that does not lock the device may have it open.
TEST_F(TerminalLineTest, AFailedAttemptDoesNotLeaveTheDeviceExclusive) {
  const auto other = openDevice();
  TerminalLine refused(device_, {.bitsPerChar = 7});

  EXPECT_EQ(refused.tryOpen(), OpenState::failed);

  EXPECT_FALSE(isExclusive(other));
}

TEST_F(TerminalLineTest, ReadsAllByteValuesUnchangedAndDoesNotWaitForMore) {
  ASSERT_EQ(line_.tryOpen(), OpenState::open);
  std::vector<LineByte> bytes;
  EXPECT_TRUE(line_.tryRead(bytes));
  EXPECT_THAT(bytes, IsEmpty());

  arrive(std::string_view("\0\r\x03\xff", 4));  // the kernel marks a byte of 0xff
  while (bytes.size() < 4) {
    waitFor(POLLIN);
    ASSERT_TRUE(line_.tryRead(bytes));
  }

  EXPECT_THAT(bytes, ElementsAre(LineByte{0}, LineByte{'\r'}, LineByte{3}, LineByte{0xff}));
  EXPECT_EQ(line_.takeOverruns(), 0U);
}

TEST_F(TerminalLineTest, IsLostWhenTheDeviceIsUnplugged) {
  ASSERT_EQ(line_.tryOpen(), OpenState::open);
  std::vector<LineByte> bytes;
  pty_.reset();
  waitFor(POLLIN);

  EXPECT_FALSE(line_.tryRead(bytes));
  EXPECT_EQ(line_.problem(), "read " + device_ + ": the device hung up");
  EXPECT_EQ(line_.tryWrite(bytesOf("a")), std::nullopt);
  EXPECT_EQ(line_.problem(), "write " + device_ + ": Input/output error");
}

TEST_F(TerminalLineTest, AcceptsNoBytesWhileTheBufferIsFull) {
  ASSERT_EQ(line_.tryOpen(), OpenState::open);
  const std::vector<std::uint8_t> much(100'000, 'x');
  std::optional<std::size_t> accepted;
  do {
    accepted = line_.tryWrite(much);
    ASSERT_TRUE(accepted.has_value()) << line_.problem();
  } while (accepted > 0U);

  line_.discardUnsent();

  waitFor(POLLOUT);
  EXPECT_GT(line_.tryWrite(bytesOf("a")).value(), 0U);
}

TEST_F(TerminalLineTest, AppliesChangedSettingsAgainWhenItIsReopened) {
  ASSERT_EQ(line_.tryOpen(), OpenState::open);
  EXPECT_EQ(line_.tryConfigure({.baud = 4800}), "");
  EXPECT_THAT(line_.tryConfigure({.baud = 9600, .bitsPerChar = 7}), HasSubstr("does not accept"));
  line_.close();
  pty_.reset();
  pty_.emplace(device_);

  ASSERT_EQ(line_.tryOpen(), OpenState::open);

  EXPECT_EQ(speed(), speed_t{B4800}) << "refused settings are not applied later";
}

}  // namespace
}  // namespace mpf::test
