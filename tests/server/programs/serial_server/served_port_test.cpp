// SPDX-License-Identifier: MIT
#include "server/programs/serial_server/served_port.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <optional>

#include <mpf/serial_commands.h>
#include <mpf/sync_client.h>

#include "drivers/octal_uart/octal_uart_model.h"
#include "drivers/octal_uart/octal_uart_port.h"
#include "tests/support/alarms.h"
#include "tests/support/model_carrier.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

class ServedPortTest : public testing::Test {
 protected:
  ServedPortTest() {
    options_.arguments.logLevel = "off";
    options_.servers.push_back({.server = "dmm", .port = "line"});
    carrier_.plug("IP_a", std::make_unique<OctalUartModel>());
    uart_.emplace(modules_.create("UART", "ipac", "IP_a", kOctalUart), OctalUartOptions{});
    port_ = openOctalUartPort(*uart_, 0, {});
    served_.emplace(backplane_, options_, options_.servers[0], *port_);
    served_->start([this] { hasFailed_ = true; });
  }
  // Stops the port before the objects that it uses are destroyed.
  void TearDown() override { served_.reset(); }

  Watchdog watchdog_{"served port test"};
  TestBackplane backplane_;
  SerialStartOptions options_;
  IndustryPackCarriers carriers_;
  ModelCarrier& carrier_ = addModelCarrier(carriers_);
  IndustryPackModules modules_{carriers_};
  std::optional<OctalUart> uart_;
  std::unique_ptr<SerialPort> port_;
  std::optional<ServedPort> served_;
  std::atomic<bool> hasFailed_ = false;
};

TEST_F(ServedPortTest, ALostLineIsAnAlarmAndAStatus) {
  SyncClient client(backplane_, "dmm");
  ASSERT_TRUE(client.connectWait(60s));
  ASSERT_EQ(alarmsOf(backplane_, "dmm"), 0U);

  carrier_.unplug("IP_a");

  while (alarmsOf(backplane_, "dmm") == 0) std::this_thread::yield();
  auto message = Char8ArrayMessage::allocValue(1);
  *message = {.timeout = 60, .cmd = serial::cmdWrite};
  message.setSize(1);
  auto answer = client.call(std::move(message), 60s);
  auto reply = answer.as<Char8Array>();
  ASSERT_TRUE(reply);
  EXPECT_EQ((*reply)->status, serial::serialServerStatusError);
  EXPECT_EQ(alarmsOf(backplane_, "dmm"), 1U);
}

TEST_F(ServedPortTest, EndsWhenStopped) {
  served_->stop();

  served_->join();

  EXPECT_FALSE(hasFailed_);
}

}  // namespace
}  // namespace mpf::test
