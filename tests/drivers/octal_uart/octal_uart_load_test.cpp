// SPDX-License-Identifier: MIT
// Eight ports at 38400 baud at once. The chip stores four bytes of each port, so the driver must
// serve it every 1.04 ms.
#include <array>
#include <thread>

#include "octal_uart_fixture.h"
#include "tests/support/sanitized.h"

namespace mpf::test {
namespace {

class OctalUartLoadTest : public OctalUartTest {
 protected:
  void open(const SerialSettings& settings) {
    for (int i = 0; i < 8; ++i) ports_.at(static_cast<std::size_t>(i)).emplace(*uart_, i, settings);
  }
  BoundOctalPort& port(int number) { return *ports_.at(static_cast<std::size_t>(number)); }
  static std::string textOf(int number, std::size_t bytes) {
    std::string text;
    for (std::size_t i = 0; i < bytes; ++i)
      text += static_cast<char>('a' + (i * static_cast<std::size_t>(number + 1)) % 26);
    return text;
  }
  [[nodiscard]] std::uint64_t lost(int number) const {
    return model_->with(number,
                        [](const OctalUartModelChannel& channel) { return channel.overrun(); });
  }
  // Returns whether the instruments have sent all their bytes.
  [[nodiscard]] bool isQuiet() const {
    for (int i = 0; i < 8; ++i) {
      if (!model_->with(
              i, [](const OctalUartModelChannel& channel) { return channel.incoming.empty(); }))
        return false;
    }
    return true;
  }
  // Every port and every instrument sends `bytes` bytes at the same time. Returns when all bytes
  // have been sent.
  void talkBothWays(std::size_t bytes) {
    for (int i = 0; i < 8; ++i) model_->farEndSend(i, textOf(i, bytes));
    std::vector<std::thread> writers;
    for (int i = 0; i < 8; ++i) {
      writers.emplace_back([&, i] {
        EXPECT_EQ(port(i).line->write(bytesOf(textOf(i, bytes)), kWatchdog),
                  SerialPortStatus::success);
      });
    }
    for (auto& writer : writers) writer.join();
    while (!isQuiet()) std::this_thread::sleep_for(1ms);
    model_->waitUntilServed();
  }

 private:
  std::array<std::optional<BoundOctalPort>, 8> ports_;
};

// The old driver read one byte of a port at a time, at most twice for each interrupt.
TEST_F(OctalUartLoadTest, OneInterruptReadsAllBytesOfTheChip) {
  start({.time = OctalUartModelTime::stepped});
  open(kFast);
  for (int i = 0; i < 8; ++i) model_->farEndSend(i, "abcd");

  model_->advance(4 * byteTime(kFast));

  for (int i = 0; i < 8; ++i) EXPECT_TRUE(port(i).collector.waitForAll("abcd"));
  EXPECT_EQ(uart_->counters().interrupts, 2U) << "one on each line";
}

TEST_F(OctalUartLoadTest, NoByteIsLostWhenTheDriverIsThreeBytesLate) {
  start({.time = OctalUartModelTime::stepped});
  open(kFast);
  constexpr int kBytes = 3000;
  for (int i = 0; i < 8; ++i) model_->farEndSend(i, textOf(i, kBytes));

  while (!isQuiet()) {
    model_->advance(3 * byteTime(kFast));
    model_->waitUntilServed();
  }

  for (int i = 0; i < 8; ++i) {
    EXPECT_EQ(lost(i), 0U);
    EXPECT_TRUE(port(i).collector.waitForAll(textOf(i, kBytes))) << i;
    EXPECT_EQ(port(i).port.counters().overruns, 0U);
  }
}

// With the real clock, in both directions at once. On a busy host the driver may be late and lose
// bytes, and then the round is repeated. A round in which the driver was in time may lose none.
TEST_F(OctalUartLoadTest, NoByteIsLostInRealTime) {
  const SerialSettings settings{kIsSanitized ? 1200 : 38400, 1, 8, 'N', 'N'};
  start({.time = OctalUartModelTime::clock});
  open(settings);
  constexpr std::size_t kBytes = kIsSanitized ? 20 : 150;
  for (;;) {
    std::array<std::uint64_t, 8> before{};
    for (int i = 0; i < 8; ++i) before.at(static_cast<std::size_t>(i)) = lost(i);
    static_cast<void>(model_->takeLongestWait());
    talkBothWays(kBytes);

    std::uint64_t lostNow = 0;
    for (int i = 0; i < 8; ++i) {
      const auto lostOfPort = lost(i) - before.at(static_cast<std::size_t>(i));
      lostNow += lostOfPort;
      while (port(i).collector.all().size() < kBytes - lostOfPort) std::this_thread::yield();
    }
    if (lostNow == 0) break;
    ASSERT_GT(model_->takeLongestWait(), 2 * byteTime(settings))
        << lostNow << " bytes lost, although the driver was in time";
    for (int i = 0; i < 8; ++i) port(i).collector.clear();
  }
  for (int i = 0; i < 8; ++i) {
    EXPECT_TRUE(port(i).collector.waitForAll(textOf(i, kBytes))) << i;
    EXPECT_TRUE(model_->farEndReceived(i).ends_with(textOf(i, kBytes))) << i;
  }
}

}  // namespace
}  // namespace mpf::test
