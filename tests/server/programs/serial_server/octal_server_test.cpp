// SPDX-License-Identifier: MIT
// Serial servers on the eight ports of an octal UART: what clients see of it and of its faults.
#include <array>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <optional>
#include <thread>

#include <mpf/serial_commands.h>
#include <mpf/sync_client.h>

#include "drivers/octal_uart/octal_uart_model.h"
#include "drivers/octal_uart/octal_uart_port.h"
#include "server/programs/serial_server/serial_server.h"
#include "tests/server/programs/serial_server/ask_serial.h"
#include "tests/support/model_carrier.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

// A server on a port, its client, and an instrument that answers "<n>?\r" with "<n>!\r".
class OctalStation {
 public:
  OctalStation(const Backplane& backplane, OctalUart& uart, OctalUartModel& model, int number)
      : model_(model),
        number_(number),
        port_(openOctalUartPort(uart, number, {.settings = {38400, 1, 8, 'N', 'N'}})),
        server_(backplane, "UART[" + std::to_string(number) + "]"),
        serial_(server_, *port_, {}, log_),
        thread_([this] { server_.run(); }),
        client_(backplane, server_.getName()),
        tap_(port_->attachTap([this](std::span<const PeekedByte> bytes) { follow(bytes); })) {
    EXPECT_TRUE(client_.connectWait(60s));
  }
  ~OctalStation() {
    server_.interrupt();
    thread_.join();
  }
  OctalStation(const OctalStation&) = delete;
  OctalStation& operator=(const OctalStation&) = delete;

  SerialPort& port() { return *port_; }
  void setSilent() { isSilent_ = true; }
  SerialReply ask(std::string_view text) {
    return askSerial(client_, text, {.timeout = 60, .cmd = serial::cmdWriteRead});
  }
  std::int32_t configure(const SerialConfig& settings) {
    auto answer = client_.call(SerialConfigMessage(settings), 60s);
    EXPECT_TRUE(answer) << answer.why();
    auto reply = answer.as<Int32>();
    return reply ? (*reply)->status : -1;
  }

 private:
  void follow(std::span<const PeekedByte> bytes) {
    for (const auto& byte : bytes) {
      if (byte.direction != ByteDirection::sent) continue;
      question_ += static_cast<char>(byte.value);
      if (byte.value != '\r') continue;
      const auto mark = question_.find('?');
      if (!isSilent_) model_.farEndSend(number_, question_.substr(0, mark) + "!\r");
      question_.clear();
    }
  }

  OctalUartModel& model_;
  const int number_;
  std::atomic<bool> isSilent_{false};
  std::string question_;
  ServerLog log_{"test", "off"};
  std::unique_ptr<SerialPort> port_;
  MessageServer server_;
  SerialServer serial_;
  std::thread thread_;
  SyncClient client_;
  PeekTap tap_;  // last: destroyed before the members that it uses
};

class OctalServerTest : public testing::Test {
 protected:
  OctalServerTest() {
    model_ = &carrier_.plug("IP_a", std::make_unique<OctalUartModel>());
    uart_.emplace(modules_.create("UART", "ipac", "IP_a", kOctalUart), OctalUartOptions{});
    for (int i = 0; i < 8; ++i)
      stations_.at(static_cast<std::size_t>(i)).emplace(backplane_, *uart_, *model_, i);
  }
  OctalStation& station(int number) { return *stations_.at(static_cast<std::size_t>(number)); }

  Watchdog watchdog_{"octal server test"};
  TestBackplane backplane_;
  IndustryPackCarriers carriers_;
  ModelCarrier& carrier_ = addModelCarrier(carriers_);
  IndustryPackModules modules_{carriers_};
  OctalUartModel* model_ = nullptr;
  std::optional<OctalUart> uart_;
  std::array<std::optional<OctalStation>, 8> stations_;
};

TEST_F(OctalServerTest, EightServersWorkAtTheSameTime) {
  std::vector<std::thread> clients;
  for (int i = 0; i < 8; ++i) {
    clients.emplace_back([this, i] {
      for (int k = 0; k < 50; ++k) {
        const auto text = std::to_string(1000 * i + k);
        EXPECT_EQ(station(i).ask(text + "?\r"),
                  (SerialReply{serial::serialServerStatusOK, text + "!\r"}));
      }
    });
  }
  for (auto& client : clients) client.join();
}

TEST_F(OctalServerTest, SettingsThatTheChipDoesNotHaveAreAnErrorStatus) {
  EXPECT_EQ(station(2).configure({.baud = 57600}), serial::serialServerStatusError);
  EXPECT_EQ(station(2).configure({.baud = 300, .parity = 'E'}), serial::serialServerStatusOK);

  const auto settings =
      model_->with(2, [](const OctalUartModelChannel& channel) { return channel.settings(); });
  EXPECT_EQ(settings, (SerialSettings{300, 1, 8, 'E', 'N'}));
}

TEST_F(OctalServerTest, EveryRequestGetsAReplyWhileTheModuleIsMissing) {
  carrier_.setFault("IP_a", ModelFault::busError);
  EXPECT_TRUE(station(5).port().waitForState(SerialPortState::unplugged, Deadline::never()));

  EXPECT_EQ(station(5).ask("1?\r").status, serial::serialServerStatusError);
  EXPECT_EQ(station(5).configure({.baud = 300}), serial::serialServerStatusError);

  carrier_.setFault("IP_a", ModelFault::none);
  EXPECT_TRUE(station(5).port().waitForState(SerialPortState::plugged, Deadline::never()));
  EXPECT_EQ(station(5).ask("1?\r"), (SerialReply{serial::serialServerStatusOK, "1!\r"}));
}

TEST_F(OctalServerTest, ARequestOnTheLineIsAnsweredWhenTheModuleGoes) {
  station(3).setSilent();
  std::thread puller([&] {
    model_->waitUntilFarEndReceived(3, "never?\r");
    carrier_.unplug("IP_a");
  });

  EXPECT_EQ(station(3).ask("never?\r").status, serial::serialServerStatusError);

  puller.join();
}

}  // namespace
}  // namespace mpf::test
