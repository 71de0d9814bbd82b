// SPDX-License-Identifier: MIT
#include "drivers/serial/polled_serial_port.h"

#include <sys/eventfd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdexcept>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"
#include "tests/drivers/serial/line_collector.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;

// The simulated line. The test's thread and the port's thread use it.
class Script {
 public:
  // Lets `bytes` arrive; `overruns` more bytes were lost.
  void arrive(const std::vector<LineByte>& bytes, std::uint64_t overruns = 0) {
    const std::lock_guard lock(mutex_);
    arrived_.insert(arrived_.end(), bytes.begin(), bytes.end());
    overruns_ += overruns;
    const std::uint64_t one = 1;
    checkCall(::write(bell.get(), &one, sizeof one), "write");
  }
  void take(std::vector<LineByte>& bytes) {
    const std::lock_guard lock(mutex_);
    std::uint64_t rings = 0;
    static_cast<void>(::read(bell.get(), &rings, sizeof rings));
    bytes.insert(bytes.end(), arrived_.begin(), arrived_.end());
    arrived_.clear();
  }
  std::uint64_t takeOverruns() {
    const std::lock_guard lock(mutex_);
    return std::exchange(overruns_, 0);
  }

  const FileDescriptor bell{checkCall(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC), "eventfd")};
  std::atomic<bool> isHeldUp = false;  // sent bytes stay in the kernel's queue
  std::atomic<int> discards = 0;
  std::atomic<bool> isInBreak = false;

 private:
  std::mutex mutex_;
  std::vector<LineByte> arrived_;
  std::uint64_t overruns_ = 0;
};

class SimulatedLine : public SerialLine {
 public:
  explicit SimulatedLine(Script& script) : script_(script) {}
  std::string description() const override { return "simulated"; }
  std::string problem() const override { return {}; }
  OpenState tryOpen() override { return OpenState::open; }
  std::chrono::milliseconds openTimeout() const override { return {}; }
  void close() noexcept override {}
  pollfd waitsFor() const noexcept override { return {script_.bell.get(), POLLIN, 0}; }
  bool tryRead(std::vector<LineByte>& bytes) override {
    script_.take(bytes);
    return true;
  }
  std::optional<std::size_t> tryWrite(std::span<const std::uint8_t> bytes) override {
    return bytes.size();
  }
  std::chrono::milliseconds timeToSend() const override { return script_.isHeldUp ? 1ms : 0ms; }
  void discardUnsent() noexcept override { ++script_.discards; }
  std::uint64_t takeOverruns() noexcept override { return script_.takeOverruns(); }
  std::string tryConfigure(const SerialSettings& /*settings*/) override { return {}; }
  bool trySetBreak(bool on) noexcept override {
    script_.isInBreak = on;
    return true;
  }

 private:
  Script& script_;
};

class PolledSerialPortTest : public testing::Test {
 protected:
  Script script_;
  LineCollector collector_;
  PolledSerialPort port_{std::make_unique<SimulatedLine>(script_), false};
  BoundSerialPort line_{port_, collector_};
};

// A tap that lets `answer` arrive when bytes are sent.
PeekHandler answering(Script& script, const std::vector<LineByte>& answer) {
  return [&script, answer](std::span<const PeekedByte> bytes) {
    if (bytes.front().direction == ByteDirection::sent) script.arrive(answer);
  };
}

TEST_F(PolledSerialPortTest, ADamagedByteFailsTheReadAndIsCounted) {
  for (const auto fault : {LineFault::parity, LineFault::framing, LineFault::breakSignal}) {
    const auto tap = port_.attachTap(answering(script_, {{'a'}, {'b', fault}, {'\r'}, {'\n'}}));

    EXPECT_EQ(line_->writeRead(bytesOf("?"), kWatchdog), SerialPortStatus::failure);
  }

  const auto counters = line_->counters();
  EXPECT_EQ(counters.parityErrors, 1U);
  EXPECT_EQ(counters.framingErrors, 1U);
  EXPECT_EQ(counters.breaks, 1U);
  EXPECT_TRUE(collector_.waitForAll("a\r\na\r\na\r\n")) << "damaged bytes are not passed on";
}

TEST_F(PolledSerialPortTest, TapsSeeDamagedBytesWithTheirFault) {
  std::vector<LineFault> faults;
  const auto tap = port_.attachTap([&](std::span<const PeekedByte> bytes) {
    for (const auto& byte : bytes) faults.push_back(byte.fault);
  });
  script_.arrive({{'a'}, {'b', LineFault::parity}, {'\n'}});
  EXPECT_TRUE(collector_.waitForAll("a\n"));

  line_->release();  // no bytes are shown after this

  EXPECT_THAT(faults, ElementsAre(LineFault::none, LineFault::parity, LineFault::none));
}

TEST_F(PolledSerialPortTest, ReadingIsEnabledBeforeTheFirstByteIsSent) {
  int readsBegun = 0;
  const auto tap =
      port_.attachTap([&](std::span<const PeekedByte>) { readsBegun = collector_.readsBegun(); });

  EXPECT_EQ(line_->writeRead(bytesOf("?"), 0ms), SerialPortStatus::timeout);

  EXPECT_EQ(readsBegun, 1);
}

// Otherwise a flush at the start of a request would leave bytes in the kernel.
TEST_F(PolledSerialPortTest, BytesFromBeforeTheRequestBelongToNoRead) {
  for (int round = 0; round < 100; ++round) {
    script_.arrive({{'a'}, {'\r'}, {'\n'}});

    EXPECT_EQ(line_->writeRead(bytesOf("?"), 0ms), SerialPortStatus::timeout);
  }
}

TEST_F(PolledSerialPortTest, LostBytesAreCounted) {
  script_.arrive({{'a'}}, 3);

  EXPECT_TRUE(collector_.waitForAll("a"));
  EXPECT_EQ(line_->counters().overruns, 3U);
}

TEST_F(PolledSerialPortTest, AnAnswerWithAGapFailsTheRead) {
  const auto tap = port_.attachTap([&](std::span<const PeekedByte> bytes) {
    if (bytes.front().direction == ByteDirection::sent) script_.arrive({{'a'}, {'\r'}, {'\n'}}, 1);
  });

  EXPECT_EQ(line_->writeRead(bytesOf("?"), kWatchdog), SerialPortStatus::failure);
}

TEST_F(PolledSerialPortTest, AGapIsReportedAtItsPlace) {
  script_.arrive({{'a'}, {'b', LineFault::none, true}, {'c'}, {'d', LineFault::none, true}}, 3);

  EXPECT_TRUE(collector_.waitForAll("abcd"));
  EXPECT_THAT(collector_.faults(), ElementsAre(ReportedFault{1, LineFault::overrun, 3},
                                               ReportedFault{3, LineFault::overrun, 0}));
}

TEST_F(PolledSerialPortTest, AGapAtAnUnknownPlaceIsReportedBeforeTheBytes) {
  script_.arrive({{'a'}, {'b'}}, 2);

  EXPECT_TRUE(collector_.waitForAll("ab"));
  EXPECT_THAT(collector_.faults(), ElementsAre(ReportedFault{0, LineFault::overrun, 2}));
}

TEST_F(PolledSerialPortTest, DamageIsReportedAtThePlaceOfTheByte) {
  script_.arrive({{'a'}, {'b', LineFault::framing}, {'c'}});

  EXPECT_TRUE(collector_.waitForAll("ac"));
  EXPECT_THAT(collector_.faults(), ElementsAre(ReportedFault{1, LineFault::framing, 1}));
}

TEST_F(PolledSerialPortTest, AWriteThatIsNotSentInTimeIsDiscarded) {
  script_.isHeldUp = true;

  EXPECT_EQ(line_->write(bytesOf("a"), 20ms), SerialPortStatus::timeout);

  EXPECT_EQ(script_.discards, 1);
}

TEST_F(PolledSerialPortTest, AWriteWithTimeoutZeroDoesNotWaitForTheLine) {
  script_.isHeldUp = true;

  EXPECT_EQ(line_->write(bytesOf("a"), 0ms), SerialPortStatus::success);

  EXPECT_EQ(script_.discards, 0);
}

TEST_F(PolledSerialPortTest, AReadThatTimesOutDiscardsNoOutput) {
  EXPECT_EQ(line_->read(1ms), SerialPortStatus::timeout);

  EXPECT_EQ(script_.discards, 0);
}

// The answer may arrive before the line reports that the last bytes are sent.
TEST_F(PolledSerialPortTest, AnAnswerEndsAWriteReadBeforeAllBytesAreSent) {
  script_.isHeldUp = true;
  const auto tap = port_.attachTap(answering(script_, {{'a'}, {'\r'}, {'\n'}}));

  EXPECT_EQ(line_->writeRead(bytesOf("?"), kWatchdog), SerialPortStatus::success);
}

TEST_F(PolledSerialPortTest, ARequestThatItsBinderAbandonsFails) {
  int asked = 0;
  line_->abandonWhen([&] { return ++asked == 2; });

  EXPECT_EQ(line_->read(Deadline::never()), SerialPortStatus::failure);

  EXPECT_EQ(asked, 2);
  line_->abandonWhen({});
  const auto tap = port_.attachTap(answering(script_, {{'a'}, {'\r'}, {'\n'}}));
  EXPECT_EQ(line_->writeRead(bytesOf("?"), kWatchdog), SerialPortStatus::success);
}

// A handler that refuses reads, and counts calls of sendBegins().
struct Refuser : ByteHandler {
  ByteHandlerResult byteReceived(std::uint8_t /*byte*/) override { return ByteHandlerResult::ok; }
  ByteHandlerResult readBegins() override {
    return refuses ? ByteHandlerResult::error : ByteHandlerResult::ok;
  }
  void sendBegins() override { ++sends; }
  std::atomic<bool> refuses = true;
  std::atomic<int> sends = 0;
};

TEST_F(PolledSerialPortTest, ARequestThatItsHandlerRefusesIsNotSent) {
  line_->release();
  Refuser refuser;
  const BoundSerialPort line(port_, refuser);

  EXPECT_EQ(line->writeRead(bytesOf("?"), kWatchdog), SerialPortStatus::failure);
  EXPECT_EQ(line->counters().bytesOut, 0U);
  EXPECT_EQ(script_.discards, 0) << "bytes of an earlier request stay in the kernel";

  refuser.refuses = false;
  EXPECT_EQ(line->writeRead(bytesOf("?"), 1ms), SerialPortStatus::timeout);
  EXPECT_EQ(refuser.sends, 1);
}

TEST_F(PolledSerialPortTest, ReleaseEndsABreak) {
  std::jthread other(
      [&] { EXPECT_EQ(port_.sendBreak(std::chrono::hours(1)), SerialPortStatus::failure); });
  for (const auto deadline = watchdog(); !script_.isInBreak && !deadline.hasPassed();)
    std::this_thread::yield();
  ASSERT_TRUE(script_.isInBreak);

  line_->release();

  other.join();
  EXPECT_FALSE(script_.isInBreak);
}

}  // namespace
}  // namespace mpf::test
