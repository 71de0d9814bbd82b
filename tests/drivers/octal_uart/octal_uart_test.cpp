// SPDX-License-Identifier: MIT
#include <thread>

#include <mpf/drivers/industry_pack/industry_pack_error.h>

#include "drivers/serial/late_line.h"
#include "drivers/serial/polled_serial_port.h"
#include "octal_uart_fixture.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

class OctalUartFaultTest : public OctalUartTest {
 protected:
  // Has no time limit, because the pause between two attempts to open grows with each failure.
  static void waitUntil(const SerialPort& port, SerialPortState state) {
    EXPECT_TRUE(port.waitForState(state, Deadline::never()));
  }
};

TEST_F(OctalUartFaultTest, WritesItsVectorIntoMemorySpace) {
  start({}, {.vector = 0x68});

  EXPECT_EQ(model_->vector(), 0x68);
}

TEST_F(OctalUartFaultTest, ASiteWithoutMemoryIsRefused) {
  auto& bare = addCarrier(std::make_unique<ModelCarrier>(4, 0), "bare");
  bare.plug("IP_b", std::make_unique<OctalUartModel>());
  try {
    OctalUart uart(modules_.create("UART", "bare", "IP_b", kOctalUart), {});
    FAIL() << "no error";
  } catch (const IndustryPackError& error) {
    EXPECT_EQ(error.status(), IndustryPackStatus::badAddress);
    EXPECT_THAT(error.what(), HasSubstr("carrier bare, site IP_b has no memory space"));
  }
}

TEST_F(OctalUartFaultTest, RefusesOtherNumbersOfPortsThanFourAndEight) {
  EXPECT_THROW(start({}, {.ports = 6}), std::invalid_argument);
}

TEST_F(OctalUartFaultTest, AcceptsItsThreeModels) {
  for (const auto kind : kOctalUart.models) {
    IndustryPackModules modules(carriers_);
    plug({.model = kind});
    EXPECT_EQ(modules.create("UART", "ipac", "IP_a", kOctalUart).idProm().model, kind);
    carrier_.unplug("IP_a");
  }
}

TEST_F(OctalUartFaultTest, AStormIsAnAlarmAndEveryPortKeepsWorking) {
  BoundOctalPort low(start({}, {.pollEvery = 1ms}), 1, kFast);
  BoundOctalPort high(*uart_, 6, kFast);

  carrier_.setFault("IP_a", ModelFault::interruptStorm);

  alarms_.waitFor(OctalUartAlarm::storm);
  EXPECT_TRUE(echoes(low, 1));
  EXPECT_TRUE(echoes(high, 6));
  EXPECT_EQ(low.port.state(), SerialPortState::plugged);
}

// A stuck line uses one processor permanently, also while the ports have traffic.
TEST_F(OctalUartFaultTest, AStormIsDetectedDespiteTraffic) {
  // more than the number of spurious interrupts in a row
  BoundOctalPort low(start({}, {.stormLimit = 20'000}), 1, kFast);
  BoundOctalPort high(*uart_, 6, kFast);

  carrier_.setFault("IP_a", ModelFault::interruptStorm, 0);

  while (alarms_.count(OctalUartAlarm::storm) == 0) {
    EXPECT_TRUE(echoes(low, 1));
    EXPECT_TRUE(echoes(high, 6));
  }
}

TEST_F(OctalUartFaultTest, AStormIsReportedWhenItBeginsAndNotAfterEachPause) {
  constexpr int kLimit = 100;
  auto& uart = start({}, {.stormLimit = kLimit, .stormPause = 10ms});

  carrier_.setFault("IP_a", ModelFault::interruptStorm, 1);
  while (uart.counters().spurious < 10ULL * kLimit) std::this_thread::yield();

  alarms_.waitFor(OctalUartAlarm::storm);
  // 1, unless this process did not run for some time
  EXPECT_LT(alarms_.count(OctalUartAlarm::storm), 9);
}

TEST_F(OctalUartFaultTest, ADeadLineIsDetectedWhileTheOtherIsBusy) {
  BoundOctalPort low(start({}, {.pollEvery = 1ms}), 1, kFast);
  BoundOctalPort high(*uart_, 6, kFast);

  carrier_.setFault("IP_a", ModelFault::interruptsLost, 1);

  while (alarms_.count(OctalUartAlarm::noInterrupts) == 0) {
    EXPECT_TRUE(echoes(high, 6));
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(echoes(low, 1));
  }
}

// During the pause the line is masked and polled, so polls that find a request do not mean that it
// is dead.
TEST_F(OctalUartFaultTest, ALineThatIsMaskedInAStormIsNotReportedAsDead) {
  BoundOctalPort high(start({}, {.pollEvery = 1ms, .stormLimit = 100, .stormPause = 1h}), 6, kFast);
  carrier_.setFault("IP_a", ModelFault::interruptStorm, 1);
  alarms_.waitFor(OctalUartAlarm::storm);

  for (int i = 0; i < 50; ++i) EXPECT_TRUE(echoes(high, 6));

  EXPECT_EQ(alarms_.count(OctalUartAlarm::noInterrupts), 0);
}

TEST_F(OctalUartFaultTest, AlarmsFromBeforeTheHandlerIsSetAreReportedLater) {
  plug({});
  OctalUart uart(modules_.create("UART", "ipac", "IP_a", kOctalUart), {.pollEvery = 1ms});
  const auto port = openOctalUartPort(uart, 0, {});
  carrier_.setFault("IP_a", ModelFault::busError);
  waitUntil(*port, SerialPortState::unplugged);
  while (uart.counters().alarms == 0) std::this_thread::yield();
  carrier_.setFault("IP_a", ModelFault::interruptStorm, 0);  // the thread serves later interrupts
  for (const auto before = uart.counters().interrupts; uart.counters().interrupts == before;)
    std::this_thread::yield();

  uart.onAlarm([this](OctalUartAlarm alarm, const std::string& /*what*/) { alarms_.add(alarm); });

  alarms_.waitFor(OctalUartAlarm::lost);
}

TEST_F(OctalUartFaultTest, WithoutInterruptsItIsPolledAndReportsIt) {
  BoundOctalPort bound(start({}, {.pollEvery = 1ms}), 6, kFast);

  carrier_.setFault("IP_a", ModelFault::interruptsLost);

  while (alarms_.count(OctalUartAlarm::noInterrupts) == 0) EXPECT_TRUE(echoes(bound, 6));
  EXPECT_EQ(bound.port.state(), SerialPortState::plugged);
}

TEST_F(OctalUartFaultTest, NormalTrafficCausesNoAlarm) {
  BoundOctalPort bound(start({}, {.pollEvery = 1ms}), 6, kFast);

  for (int i = 0; i < 300; ++i) ASSERT_TRUE(echoes(bound, 6));

  EXPECT_EQ(alarms_.count(OctalUartAlarm::storm), 0);
  EXPECT_EQ(alarms_.count(OctalUartAlarm::lost), 0);
}

TEST_F(OctalUartFaultTest, AModuleThatReadsAsOnesUnplugsItsPorts) {
  BoundOctalPort one(start(), 0, kFast);
  BoundOctalPort other(*uart_, 7, {1200, 2, 7, 'O', 'N'});

  carrier_.setFault("IP_a", ModelFault::busError);

  waitUntil(one.port, SerialPortState::unplugged);
  waitUntil(other.port, SerialPortState::unplugged);
  EXPECT_EQ(one.line->write(bytesOf("x"), kWatchdog), SerialPortStatus::failure);
  EXPECT_THAT(one.port.unpluggedBecause(), HasSubstr("carrier ipac, site IP_a"));
  alarms_.waitFor(OctalUartAlarm::lost);

  carrier_.setFault("IP_a", ModelFault::none);

  waitUntil(one.port, SerialPortState::plugged);
  waitUntil(other.port, SerialPortState::plugged);
  EXPECT_TRUE(echoes(one, 0));
  EXPECT_TRUE(echoes(other, 7));
  EXPECT_EQ(alarms_.count(OctalUartAlarm::lost), 1);
}

TEST_F(OctalUartFaultTest, AnOutstandingRequestFailsWhenTheModuleIsLost) {
  BoundOctalPort bound(start(), 3, kFast);
  SerialPortStatus status{};
  std::thread reader([&] { status = bound.line->writeRead(bytesOf("?"), kWatchdog); });
  model_->waitUntilFarEndReceived(3, "?");

  carrier_.setFault("IP_a", ModelFault::busError);

  reader.join();
  EXPECT_EQ(status, SerialPortStatus::failure);
}

TEST_F(OctalUartFaultTest, AReplacementModuleGetsTheSameSettings) {
  BoundOctalPort bound(start({}, {.vector = 0x70}), 4, {4800, 2, 7, 'E', 'N'});
  carrier_.unplug("IP_a");
  waitUntil(bound.port, SerialPortState::unplugged);

  plug({});

  waitUntil(bound.port, SerialPortState::plugged);
  EXPECT_EQ(settingsInChip(4), (SerialSettings{4800, 2, 7, 'E', 'N'}));
  EXPECT_EQ(model_->vector(), 0x70);
  EXPECT_TRUE(echoes(bound, 4));
}

TEST_F(OctalUartFaultTest, AModuleOfAnotherKindInItsPlaceIsNotAccessed) {
  BoundOctalPort bound(start(), 4, kFast);
  carrier_.unplug("IP_a");
  waitUntil(bound.port, SerialPortState::unplugged);

  plug({.model = 0x11});

  while (bound.port.unpluggedBecause().find("is not the expected GreenSpring Octal") ==
         std::string::npos)
    std::this_thread::yield();
  EXPECT_EQ(model_->vector(), 0x0f);
}

// An Octal 485 drives its line while RTS is asserted; on an Octal 232, RTS is always asserted.
TEST_F(OctalUartFaultTest, AnotherModelInItsPlaceIsNotWrittenTo) {
  {
    BoundOctalPort bound(start(), 4, kFast);
    carrier_.unplug("IP_a");
    waitUntil(bound.port, SerialPortState::unplugged);

    plug({.model = 0x48});

    while (bound.port.unpluggedBecause().find("0xf0/0x48 in place of 0xf0/0x22") ==
           std::string::npos)
      std::this_thread::yield();
    EXPECT_EQ(bound.line->write(bytesOf("x"), kWatchdog), SerialPortStatus::failure);
    EXPECT_EQ(alarms_.count(OctalUartAlarm::lost), 1);
  }
  uart_.reset();

  EXPECT_EQ(model_->writes(), 0U);
}

TEST_F(OctalUartFaultTest, AnotherModelIsNotWrittenToByAPortThatIsOpenedLater) {
  auto& uart = start();
  carrier_.unplug("IP_a");
  plug({.model = 0x48});

  EXPECT_THROW(static_cast<void>(openOctalUartPort(uart, 1, {})), std::runtime_error);
  uart_.reset();

  EXPECT_EQ(model_->writes(), 0U);
}

TEST_F(OctalUartFaultTest, AModuleThatWasReplacedWhileNoPortWasOpenIsSetUp) {
  auto& uart = start({}, {.vector = 0x70});
  carrier_.unplug("IP_a");
  plug({});

  BoundOctalPort bound(uart, 1, kFast);

  EXPECT_EQ(model_->vector(), 0x70);
  EXPECT_TRUE(echoes(bound, 1));
}

TEST_F(OctalUartFaultTest, AChipThatWasResetGetsItsSettingsAgain) {
  BoundOctalPort bound(start(), 2, {4800, 2, 7, 'E', 'N'});

  model_->reset();

  alarms_.waitFor(OctalUartAlarm::lost);
  waitUntil(bound.port, SerialPortState::plugged);
  while (!echoes(bound, 2)) {
  }
  EXPECT_EQ(settingsInChip(2), (SerialSettings{4800, 2, 7, 'E', 'N'}));
}

TEST_F(OctalUartFaultTest, APortMayWaitForItsModule) {
  auto& uart = start();
  carrier_.setFault("IP_a", ModelFault::busError);
  while (uart.counters().alarms == 0) std::this_thread::yield();
  EXPECT_THROW(static_cast<void>(openOctalUartPort(uart, 1, {})), std::runtime_error);
  const auto port = openOctalUartPort(uart, 1, {.settings = kFast, .waitForModule = true});
  EXPECT_EQ(port->state(), SerialPortState::unplugged);

  carrier_.setFault("IP_a", ModelFault::none);

  waitUntil(*port, SerialPortState::plugged);
}

// Also for a module or a carrier that was absent at the start.
TEST_F(OctalUartFaultTest, ALateLineOpensWhenItsModuleIsPresent) {
  auto line = std::make_unique<LateLine>("port 3 of UART", [this] {
    if (!uart_)
      uart_.emplace(modules_.create("UART", "ipac", "IP_a", kOctalUart), OctalUartOptions{});
    return std::make_unique<OctalUartLine>(*uart_, 3, kFast);
  });
  LineCollector collector("\r");
  PolledSerialPort port(std::move(line), true);
  BoundSerialPort bound(port, collector);
  EXPECT_EQ(bound->write(bytesOf("x"), kWatchdog), SerialPortStatus::failure);
  while (port.unpluggedBecause() != "no module at carrier ipac, site IP_a")
    std::this_thread::yield();

  auto& model = plug({});

  EXPECT_TRUE(port.waitForState(SerialPortState::plugged, Deadline::never()));
  EXPECT_EQ(bound->write(bytesOf("x"), kWatchdog), SerialPortStatus::success);
  EXPECT_EQ(model.farEndReceived(3), "x");
  EXPECT_EQ(port.description(), "port 3 of UART");
}

// The unsent bytes of a write are lost with the line; they must not be reported as sent.
TEST_F(OctalUartFaultTest, BytesOnALostLineAreNeverReportedAsSent) {
  auto& uart = start({.time = OctalUartModelTime::stepped});
  OctalUartLine line(uart, 3, kFast);
  ASSERT_EQ(line.tryOpen(), SerialLine::OpenState::open);
  ASSERT_EQ(line.tryWrite(bytesOf("abcd")), 4U);

  carrier_.setFault("IP_a", ModelFault::busError);
  alarms_.waitFor(OctalUartAlarm::lost);

  EXPECT_GT(line.timeToSend(), 0ms);
}

// Also a channel that the previous program left with its interrupt enabled.
TEST_F(OctalUartFaultTest, ChannelsWithoutAPortOnAQuadModuleAreMasked) {
  plug({});
  auto& io = carrier_.site(0).io();
  io.write8(scc2698b::atBlock(3, scc2698b::kImr), scc2698b::kOnes);
  io.write8(scc2698b::at(6, scc2698b::kCr), scc2698b::kCrEnableRx | scc2698b::kCrEnableTx);
  {
    const OctalUart uart(modules_.create("UART", "ipac", "IP_a", kOctalUart), {.ports = 4});
  }
  EXPECT_EQ(io.read8(scc2698b::at(6, scc2698b::kSr)), 0);
  auto& line = carrier_.site(0).interrupt(1);
  static_cast<void>(line.take());
  line.enable();

  io.write8(scc2698b::at(6, scc2698b::kCr), scc2698b::kCrEnableTx);

  EXPECT_EQ(line.take(), 0U);
}

TEST_F(OctalUartFaultTest, TheChipIsDisabledWhenTheDriverIsDestroyed) {
  {
    auto& uart = start();
    const auto port = openOctalUartPort(uart, 0, {});
  }
  uart_.reset();

  model_->farEndSend(0, "not received");

  EXPECT_EQ(carrier_.site(0).interrupt(0).take(), 0U);
  carrier_.site(0).interrupt(0).enable();
  EXPECT_EQ(carrier_.site(0).interrupt(0).take(), 0U);
}

}  // namespace
}  // namespace mpf::test
