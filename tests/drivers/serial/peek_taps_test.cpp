// SPDX-License-Identifier: MIT
#include <mpf/drivers/serial/peek_taps.h>

#include <gtest/gtest.h>
#include <mutex>
#include <optional>

#include <mpf/drivers/serial/posix_terminal.h>

#include "tests/drivers/serial/line_collector.h"
#include "tests/support/instrument.h"
#include "tests/support/temporary_folder.h"

namespace mpf::test {
namespace {

// Records the bytes of a tap as text: "T:" before sent bytes, "R:" before received bytes.
class Recorder {
 public:
  PeekHandler handler() {
    return [this](std::span<const PeekedByte> bytes) {
      const std::lock_guard lock(mutex_);
      for (const auto& byte : bytes) record(byte);
    };
  }
  [[nodiscard]] std::string text() const {
    const std::lock_guard lock(mutex_);
    return text_;
  }
  [[nodiscard]] bool isInTimeOrder() const {
    const std::lock_guard lock(mutex_);
    return isInTimeOrder_;
  }

 private:
  void record(const PeekedByte& byte) {
    if (direction_ != byte.direction) text_ += byte.direction == ByteDirection::sent ? "T:" : "R:";
    direction_ = byte.direction;
    text_ += static_cast<char>(byte.value);
    isInTimeOrder_ = isInTimeOrder_ && byte.atNs >= lastNs_;
    lastNs_ = byte.atNs;
  }
  mutable std::mutex mutex_;
  std::string text_;
  std::optional<ByteDirection> direction_;
  std::int64_t lastNs_ = 0;
  bool isInTimeOrder_ = true;
};

class PeekTest : public testing::Test {
 protected:
  TemporaryFolder folder_;
  Instrument instrument_{folder_.file("tty")};
  LineCollector collector_;
  const std::unique_ptr<SerialPort> owner_ = openPosixTerminal({.device = folder_.file("tty")});
  SerialPort& port_ = *owner_;
  BoundSerialPort line_{port_, collector_};

  void ask(std::string_view command) {
    EXPECT_EQ(line_->writeRead(bytesOf(command), kWatchdog), SerialPortStatus::success);
  }
};

TEST_F(PeekTest, TapSeesBothDirectionsInTheOrderOfTheLine) {
  Recorder recorder;
  const auto tap = port_.attachTap(recorder.handler());

  for (int i = 0; i < 50; ++i) ask("ECHO a\n");

  std::string expected;
  for (int i = 0; i < 50; ++i) expected += "T:ECHO a\nR:a\r\n";
  EXPECT_EQ(recorder.text(), expected);
  EXPECT_TRUE(recorder.isInTimeOrder());
}

TEST_F(PeekTest, AnyNumberOfTapsSeeTheSame) {
  Recorder first;
  Recorder second;
  const auto firstTap = port_.attachTap(first.handler());
  const auto secondTap = port_.attachTap(second.handler());

  ask("ECHO a\n");

  EXPECT_EQ(first.text(), "T:ECHO a\nR:a\r\n");
  EXPECT_EQ(second.text(), first.text());
}

TEST_F(PeekTest, ADetachedTapSeesNothingMore) {
  Recorder recorder;
  {
    const auto tap = port_.attachTap(recorder.handler());
    ask("ECHO a\n");
  }

  ask("ECHO b\n");

  EXPECT_EQ(recorder.text(), "T:ECHO a\nR:a\r\n");
}

TEST_F(PeekTest, AttachingAndDetachingTapsDoesNotDisturbRequests) {
  std::jthread fidget([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      Recorder recorder;
      const auto tap = port_.attachTap(recorder.handler());
    }
  });

  for (int i = 0; i < 200; ++i) ask("*IDN?\n");

  EXPECT_EQ(line_->counters().timeouts + line_->counters().failures, 0U);
}

// Lets `taps` show a byte, for tests without a port.
void show(const PeekTaps& taps, char value) {
  const PeekedByte byte{.value = static_cast<std::uint8_t>(value),
                        .direction = ByteDirection::received};
  taps.show({&byte, 1});
}

TEST(PeekTaps, AreEmptyWithoutATap) {
  const auto taps = std::make_shared<PeekTaps>();
  EXPECT_TRUE(taps->isEmpty());
  {
    const auto tap = taps->attach([](auto) {});
    EXPECT_FALSE(taps->isEmpty());
  }
  EXPECT_TRUE(taps->isEmpty());
}

TEST(PeekTaps, SeeBytesInTheOrderInWhichTheyWereAttached) {
  const auto taps = std::make_shared<PeekTaps>();
  std::string order;
  auto first = taps->attach([&](auto) { order += '1'; });
  const auto second = taps->attach([&](auto) { order += '2'; });
  show(*taps, 'a');
  first.detach();
  first = taps->attach([&](auto) { order += '3'; });

  show(*taps, 'b');

  EXPECT_EQ(order, "1223");
}

TEST(PeekTap, ListensAfterAMoveAndReplacesTheTapThatItIsAssignedTo) {
  const auto taps = std::make_shared<PeekTaps>();
  Recorder one;
  Recorder other;
  auto source = taps->attach(one.handler());
  auto target = taps->attach(other.handler());
  show(*taps, 'a');

  target = std::move(source);
  show(*taps, 'b');
  source.detach();  // NOLINT(bugprone-use-after-move): a moved tap is not attached
  show(*taps, 'c');

  EXPECT_EQ(one.text(), "R:abc");
  EXPECT_EQ(other.text(), "R:a");
  target.detach();
  target.detach();
  EXPECT_TRUE(taps->isEmpty());
}

TEST(PeekTap, MayOutliveThePort) {
  const TemporaryFolder folder;
  const Instrument instrument(folder.file("tty"));
  Recorder recorder;
  PeekTap tap;
  {
    const auto port = openPosixTerminal({.device = folder.file("tty")});
    tap = port->attachTap(recorder.handler());
  }

  tap.detach();

  EXPECT_EQ(recorder.text(), "");
}

}  // namespace
}  // namespace mpf::test
