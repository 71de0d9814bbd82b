// SPDX-License-Identifier: MIT
// What clients, `mpf msr` and the log report of a serial line that loses and damages bytes: on a
// port of an octal UART.
#include "server/programs/serial_server/line_faults.h"

#include <array>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <optional>
#include <thread>

#include <mpf/serial_commands.h>
#include <mpf/sync_client.h>

#include "base/log_limiter.h"
#include "drivers/octal_uart/octal_uart_model.h"
#include "drivers/octal_uart/octal_uart_port.h"
#include "server/programs/serial_server/serial_server.h"
#include "tests/support/alarms.h"
#include "tests/support/log_lines.h"
#include "tests/support/model_carrier.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace serial;
using namespace std::chrono_literals;

constexpr SerialSettings kFast{38400, 1, 8, 'N', 'N'};
constexpr const char* kServer = "dmm";

struct Answer {
  std::int32_t status = -1;
  std::int32_t extra = -1;
  std::string text;
  friend bool operator==(const Answer&, const Answer&) = default;
  friend std::ostream& operator<<(std::ostream& out, const Answer& answer) {
    return out << "status " << answer.status << ", extra " << answer.extra << ", \"" << answer.text
               << '"';
  }
};

class LineFaultsTest : public testing::Test {
 protected:
  void start(OctalUartModelTime time = OctalUartModelTime::instant, const char* logLevel = "off") {
    model_ = &carrier_.plug("IP_a",
                            std::make_unique<OctalUartModel>(OctalUartModelOptions{.time = time}));
    uart_.emplace(modules_.create("UART", "ipac", "IP_a", kOctalUart), OctalUartOptions{});
    port_ = openOctalUartPort(*uart_, 0, {.settings = kFast});
    log_.emplace("test", logLevel);
    server_.emplace(backplane_, kServer);
    serial_.emplace(*server_, *port_, SerialServerOptions{}, *log_);
    thread_ = std::thread([this] { server_->run(); });
    client_.emplace(backplane_, kServer);
    ASSERT_TRUE(client_->connectWait(60s));
  }
  void stop() {
    if (thread_.joinable()) {
      server_->interrupt();
      thread_.join();
    }
    serial_.reset();
    log_.reset();
  }
  void TearDown() override { stop(); }

  // Returns when all bytes that the far end has sent are in the server's buffer, or lost.
  void waitForBytes(std::uint64_t count) {
    while (port_->counters().bytesIn < count) std::this_thread::yield();
    static_cast<void>(port_->config({}));  // returns after the port's thread has handled them
  }
  // A byte at a time: nothing gets lost.
  void saySlowly(const std::string& text) {
    model_->farEndSend(0, text);
    for (std::size_t i = 0; i < text.size(); ++i) {
      model_->advance(byteTime(kFast));
      model_->waitUntilServed();
    }
  }
  Answer ask(std::int32_t cmd, const std::string& text = {}, std::int32_t extra = 0) {
    auto message = Char8ArrayMessage::allocValue(text.size());
    *message = {.timeout = 60, .cmd = cmd, .extra = extra};
    message.setSize(text.size());
    std::ranges::copy(text, message.value().begin());
    auto answer = client_->call(std::move(message), 60s);
    EXPECT_TRUE(answer) << answer.why();
    auto reply = answer.as<Char8Array>();
    if (!reply) return {};
    return {(*reply)->status, (*reply)->extra,
            std::string(reply->value().begin(), reply->value().end())};
  }
  void unplugAndBack() {
    carrier_.setFault("IP_a", ModelFault::busError);
    EXPECT_TRUE(port_->waitForState(SerialPortState::unplugged, Deadline::never()));
    carrier_.setFault("IP_a", ModelFault::none);
    EXPECT_TRUE(port_->waitForState(SerialPortState::plugged, Deadline::never()));
  }

  Watchdog watchdog_{"line faults test"};
  TestBackplane backplane_;
  IndustryPackCarriers carriers_;
  ModelCarrier& carrier_ = addModelCarrier(carriers_);
  IndustryPackModules modules_{carriers_};
  OctalUartModel* model_ = nullptr;
  std::optional<OctalUart> uart_;
  std::unique_ptr<SerialPort> port_;
  std::optional<ServerLog> log_;
  std::optional<MessageServer> server_;
  std::optional<SerialServer> serial_;
  std::thread thread_;
  std::optional<SyncClient> client_;
};

TEST_F(LineFaultsTest, AnAnswerThatLostBytesOutsideOfReadsIsNotOk) {
  start(OctalUartModelTime::stepped);
  model_->farEndSend(0, "abcdef\r");
  model_->advance(10 * byteTime(kFast));  // all at once: the chip loses three bytes
  waitForBytes(4);
  saySlowly("next\r");
  waitForBytes(9);

  EXPECT_EQ(ask(cmdRead), (Answer{serialServerStatusOverflow, serialFaultOverrun, "abc\r"}));
  EXPECT_EQ(ask(cmdRead), (Answer{serialServerStatusOK, 0, "next\r"}))
      << "this answer does not contain the gap";

  EXPECT_EQ(alarmsOf(backplane_, kServer), 1U);
}

TEST_F(LineFaultsTest, TheRestOfAnAnswerAfterAGapIsNotOk) {
  start(OctalUartModelTime::stepped);
  saySlowly("first\r");
  model_->farEndSend(0, "abcdefgh");
  model_->advance(10 * byteTime(kFast));
  waitForBytes(10);
  saySlowly("ij\r");
  waitForBytes(13);

  EXPECT_EQ(ask(cmdRead), (Answer{serialServerStatusOK, 0, "first\r"}));
  EXPECT_EQ(ask(cmdRead, {}, 3), (Answer{serialServerStatusOverflow, serialFaultOverrun, "abc"}));
  EXPECT_EQ(ask(cmdRead), (Answer{serialServerStatusOverflow, serialFaultOverrun, "hij\r"}));
}

TEST_F(LineFaultsTest, EachKindOfDamageHasItsBitAndIsAnAlarm) {
  start();
  std::uint64_t bytes = 0;
  for (const auto& [fault, bit] : std::vector<std::pair<LineFault, std::int32_t>>{
           {LineFault::parity, serialFaultParity},
           {LineFault::framing, serialFaultFraming},
           {LineFault::breakSignal, serialFaultBreak}}) {
    model_->farEndSend(0, "12");
    model_->farEndSend(0, std::string(1, '\0'), fault);
    model_->farEndSend(0, "4\rwhole\r");
    waitForBytes(bytes += 11);

    EXPECT_EQ(ask(cmdRead), (Answer{serialServerStatusError, bit, "124\r"}));
    EXPECT_EQ(ask(cmdRead), (Answer{serialServerStatusOK, 0, "whole\r"}));
  }

  EXPECT_EQ(alarmsOf(backplane_, kServer), 3U);
}

TEST_F(LineFaultsTest, AFaultEndsTheReadThatIsOutstanding) {
  start();
  const auto tap = port_->attachTap([this](std::span<const PeekedByte> bytes) {
    if (bytes.back().direction != ByteDirection::sent || bytes.back().value != '\r') return;
    model_->farEndSend(0, "12");
    model_->farEndSend(0, "3", LineFault::parity);
    model_->farEndSend(0, "4\r");
  });

  EXPECT_EQ(ask(cmdWriteRead, "?\r"), (Answer{serialServerStatusError, serialFaultParity, "12"}));
  EXPECT_EQ(ask(cmdRead), (Answer{serialServerStatusError, serialFaultParity, "4\r"}))
      << "the rest of a damaged answer";
}

TEST_F(LineFaultsTest, ExtraIsThatOfTheRequestWithoutAFault) {
  start();
  model_->farEndSend(0, "12345");
  waitForBytes(5);

  EXPECT_EQ(ask(cmdRead, {}, 4), (Answer{serialServerStatusOK, 4, "1234"}));
  EXPECT_EQ(ask(0, {}, 4), (Answer{serialServerStatusError, 0, ""}))
      << "an invalid command is no fault of the line";
}

TEST_F(LineFaultsTest, AFlushRemovesTheFaultsWithTheBytes) {
  start();
  model_->farEndSend(0, "1");
  model_->farEndSend(0, "2", LineFault::framing);
  waitForBytes(2);
  const auto tap = port_->attachTap([this](std::span<const PeekedByte> bytes) {
    if (bytes.back().direction == ByteDirection::sent) model_->farEndSend(0, "ok\r");
  });

  EXPECT_EQ(ask(cmdWriteRead | cmdFlush, "?"), (Answer{serialServerStatusOK, 0, "ok\r"}));
}

TEST_F(LineFaultsTest, AnAnswerThatAnUnplugTruncatedIsNotOk) {
  start();
  model_->farEndSend(0, "whole\r12");
  waitForBytes(8);
  unplugAndBack();
  model_->farEndSend(0, "34\r");
  waitForBytes(11);

  EXPECT_EQ(ask(cmdRead), (Answer{serialServerStatusOK, 0, "whole\r"}));
  EXPECT_EQ(ask(cmdRead), (Answer{serialServerStatusError, serialFaultUnplugged, "1234\r"}));
}

TEST_F(LineFaultsTest, AnUnplugBetweenAnswersDamagesNone) {
  start();
  model_->farEndSend(0, "one\r");
  waitForBytes(4);
  unplugAndBack();
  model_->farEndSend(0, "two\r");
  waitForBytes(8);

  EXPECT_EQ(ask(cmdRead), (Answer{serialServerStatusOK, 0, "one\r"}));
  EXPECT_EQ(ask(cmdRead), (Answer{serialServerStatusOK, 0, "two\r"}));
}

// The log limits the lines, and the last one has the counts of all faults.
TEST_F(LineFaultsTest, AStormCausesFewLogLinesWithPortKindsAndCounts) {
  constexpr int kFaults = 1000;
  testing::internal::CaptureStderr();
  start(OctalUartModelTime::instant, "warning");
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < kFaults; ++i)
    model_->farEndSend(0, "x", i % 2 == 0 ? LineFault::parity : LineFault::framing);
  waitForBytes(kFaults);
  EXPECT_EQ(alarmsOf(backplane_, kServer), kFaults);
  stop();
  const auto periods =
      (std::chrono::steady_clock::now() - begin) / std::chrono::nanoseconds(LogLimiter::kEveryNs);
  const auto log = testing::internal::GetCapturedStderr();

  const std::string name =
      "port 0 of UART (carrier ipac, site IP_a): the line lost or damaged bytes; since the server "
      "started: ";
  const auto lines = countLines(log, name);
  EXPECT_GE(lines.written, 1U);
  EXPECT_LE(lines.written, LogLimiter::kAtOnce + 1 + periods) << log;
  const auto last = log.substr(log.rfind(name) + name.size());
  EXPECT_THAT(last,
              testing::StartsWith("500 parity errors, 500 framing errors; check that both ends"))
      << log;
}

}  // namespace
}  // namespace mpf::test
