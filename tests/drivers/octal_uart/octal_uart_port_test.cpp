// SPDX-License-Identifier: MIT
#include "drivers/octal_uart/octal_uart_port.h"

#include <thread>

#include "octal_uart_fixture.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;

class OctalUartPortTest : public OctalUartTest {
 protected:
  // Advances the time of the model until done().
  template <class Done>
  void stepUntil(Done done) {
    while (!done()) {
      model_->advance(10us);
      std::this_thread::yield();
    }
  }
  [[nodiscard]] bool isBreaking(int number) const {
    return model_->with(number,
                        [](const OctalUartModelChannel& channel) { return channel.isBreaking(); });
  }
};

TEST_F(OctalUartPortTest, EveryPortSendsAndReceives) {
  auto& uart = start();
  for (int i = 0; i < 8; ++i) {
    BoundOctalPort bound(uart, i, kFast);

    EXPECT_TRUE(echoes(bound, i)) << i;

    EXPECT_EQ(model_->farEndReceived(i), "ok?\r");
  }
}

TEST_F(OctalUartPortTest, LongTextsPassInOrder) {
  BoundOctalPort bound(start(), 7, kFast);
  std::string text;
  for (int i = 0; i < 20'000; ++i) text += static_cast<char>('a' + i % 23);

  EXPECT_EQ(bound.line->write(bytesOf(text), kWatchdog), SerialPortStatus::success);
  model_->farEndSend(7, text);

  EXPECT_EQ(model_->farEndReceived(7), text);
  EXPECT_TRUE(bound.collector.waitForAll(text));
}

TEST_F(OctalUartPortTest, AWriteEndsWhenTheLastBitIsSent) {
  BoundOctalPort bound(start({.time = OctalUartModelTime::stepped}), 1, kFast);
  std::atomic<bool> isDone = false;
  std::thread writer([&] {
    EXPECT_EQ(bound.line->write(bytesOf("abcd"), kWatchdog), SerialPortStatus::success);
    EXPECT_EQ(model_->farEndReceived(1), "abcd");
    isDone = true;
  });

  stepUntil([&] { return isDone.load(); });

  writer.join();
}

TEST_F(OctalUartPortTest, DamagedBytesAreReportedAndCounted) {
  BoundOctalPort bound(start(), 2, kFast);
  std::vector<LineFault> faults;
  {
    const auto tap = bound.port.attachTap([&](std::span<const PeekedByte> bytes) {
      for (const auto& byte : bytes) faults.push_back(byte.fault);
    });
    model_->farEndSend(2, "a");
    model_->farEndSend(2, "b", LineFault::parity);
    model_->farEndSend(2, "c", LineFault::framing);
    model_->farEndSend(2, std::string(1, '\0'), LineFault::breakSignal);
    model_->farEndSend(2, "d\r");
    EXPECT_TRUE(bound.collector.waitForAll("ad\r"));
  }

  EXPECT_THAT(faults, ElementsAre(LineFault::none, LineFault::parity, LineFault::framing,
                                  LineFault::breakSignal, LineFault::none, LineFault::none));
  const auto counters = bound.port.counters();
  EXPECT_EQ(counters.parityErrors, 1U);
  EXPECT_EQ(counters.framingErrors, 1U);
  EXPECT_EQ(counters.breaks, 1U);
  EXPECT_EQ(counters.overruns, 0U);
}

TEST_F(OctalUartPortTest, AnOverrunIsCountedAndLosesNoOtherByte) {
  BoundOctalPort bound(start({.time = OctalUartModelTime::stepped}), 0, kFast);
  model_->farEndSend(0, "abcdef");

  model_->advance(10 * byteTime(kFast));  // in one step: the driver cannot read in between

  EXPECT_TRUE(bound.collector.waitForAll("abcf"));
  EXPECT_EQ(bound.port.counters().overruns, 1U);
}

// The chip reports that it has lost bytes; the driver reports that they are missing before the
// third or the fourth byte after that.
TEST_F(OctalUartPortTest, AnOverrunIsReportedWhereBytesAreMissing) {
  BoundOctalPort bound(start({.time = OctalUartModelTime::stepped}), 0, kFast);
  const auto pass = [&](int bytes) {
    model_->advance(bytes * byteTime(kFast));
    model_->waitUntilServed();
  };
  model_->farEndSend(0, "12345678abcdef\rnext");
  for (int i = 0; i < 8; ++i) pass(1);
  pass(7);
  for (int i = 0; i < 4; ++i) pass(1);

  EXPECT_TRUE(bound.collector.waitForAll("12345678abc\rnext"));
  EXPECT_THAT(bound.collector.faults(), ElementsAre(ReportedFault{10, LineFault::overrun, 1},
                                                    ReportedFault{11, LineFault::overrun, 0}));
}

TEST_F(OctalUartPortTest, BytesThatFitIntoTheChipAreNotLost) {
  BoundOctalPort bound(start({.time = OctalUartModelTime::stepped}), 0, kFast);
  model_->farEndSend(0, "abcd");

  model_->advance(10 * byteTime(kFast));

  EXPECT_TRUE(bound.collector.waitForAll("abcd"));
  EXPECT_EQ(bound.port.counters().overruns, 0U);
}

TEST_F(OctalUartPortTest, SendsABreak) {
  BoundOctalPort bound(start(), 4, kFast);

  EXPECT_EQ(bound.line->sendBreak(20ms), SerialPortStatus::success);

  EXPECT_EQ(model_->with(4, [](const OctalUartModelChannel& channel) { return channel.breaks(); }),
            1);
  EXPECT_FALSE(isBreaking(4));
  EXPECT_TRUE(echoes(bound, 4));
}

TEST_F(OctalUartPortTest, AWriteTimesOutWhileCtsIsInactive) {
  BoundOctalPort bound(start(), 3, {38400, 1, 8, 'N', 'H'});
  model_->setClearToSend(3, false);

  EXPECT_EQ(bound.line->write(bytesOf("never"), 30ms), SerialPortStatus::timeout);
  model_->setClearToSend(3, true);

  EXPECT_TRUE(echoes(bound, 3));
  EXPECT_EQ(model_->farEndReceived(3), "ok?\r") << "the late bytes are discarded";
}

TEST_F(OctalUartPortTest, WithoutFlowControlCtsIsIgnored) {
  BoundOctalPort bound(start(), 3, kFast);
  model_->setClearToSend(3, false);

  EXPECT_TRUE(echoes(bound, 3));
}

TEST_F(OctalUartPortTest, AssertsRtsWhileItIsOpen) {
  auto& uart = start();
  {
    const auto port = openOctalUartPort(uart, 6, {});
    EXPECT_TRUE(requestsToSend(6));
  }
  EXPECT_FALSE(requestsToSend(6));
}

// RTS switches the transmitter on; the receiver is off while the port sends.
TEST_F(OctalUartPortTest, Rs485SendsOrReceives) {
  BoundOctalPort bound(start({.model = 0x48, .time = OctalUartModelTime::stepped}), 5, kFast);
  EXPECT_FALSE(requestsToSend(5));
  std::atomic<bool> isDone = false;
  std::thread writer([&] {
    EXPECT_EQ(bound.line->write(bytesOf("talk"), kWatchdog), SerialPortStatus::success);
    isDone = true;
  });
  model_->waitUntilServed();
  while (!requestsToSend(5)) std::this_thread::yield();
  model_->farEndSend(5, "unheard");
  while (model_->farEndReceived(5) != "talk") {
    EXPECT_TRUE(requestsToSend(5));
    model_->advance(10us);
  }

  stepUntil([&] { return isDone.load(); });
  writer.join();

  EXPECT_FALSE(requestsToSend(5));
  EXPECT_GE(model_->with(5, [](const OctalUartModelChannel& channel) { return channel.unheard(); }),
            3U);
}

TEST_F(OctalUartPortTest, Rs485ReceivesAnAnswerAtOnce) {
  BoundOctalPort bound(start({.model = 0x48}), 5, kFast);
  std::thread instrument([&] {
    for (int i = 0; i < 100; ++i) {
      model_->waitUntilFarEndReceived(5, "?" + std::to_string(i) + "\r");
      while (requestsToSend(5)) std::this_thread::yield();
      model_->farEndSend(5, "yes\r");
    }
  });

  for (int i = 0; i < 100; ++i)
    EXPECT_EQ(bound.line->writeRead(bytesOf("?" + std::to_string(i) + "\r"), kWatchdog),
              SerialPortStatus::success);

  instrument.join();
}

TEST_F(OctalUartPortTest, Rs485SendsABreakAndSwitchesTheTransmitterOff) {
  BoundOctalPort bound(start({.model = 0x48}), 5, kFast);

  EXPECT_EQ(bound.line->sendBreak(20ms), SerialPortStatus::success);

  while (requestsToSend(5)) std::this_thread::yield();
}

TEST_F(OctalUartPortTest, EachPortHasItsOwnSpeed) {
  auto& uart = start();
  const auto slow = openOctalUartPort(uart, 0, {.settings = {.baud = 1200}});
  const auto fast = openOctalUartPort(uart, 1, {.settings = {.baud = 38400}});

  EXPECT_EQ(settingsInChip(0).baud, 1200);
  EXPECT_EQ(settingsInChip(1).baud, 38400);
}

TEST_F(OctalUartPortTest, APortCannotBeOpenedTwice) {
  auto& uart = start();
  const auto port = openOctalUartPort(uart, 2, {});
  try {
    const auto other = openOctalUartPort(uart, 2, {});
    FAIL() << "no error";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("port 2 is in use"));
  }
}

TEST_F(OctalUartPortTest, AQuadModuleHasFourPorts) {
  auto& uart = start({}, {.ports = 4});
  BoundOctalPort bound(uart, 3, kFast);

  EXPECT_TRUE(echoes(bound, 3));
  EXPECT_THROW(static_cast<void>(openOctalUartPort(uart, 4, {})), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(openOctalUartPort(uart, -1, {})), std::invalid_argument);
}

}  // namespace
}  // namespace mpf::test
