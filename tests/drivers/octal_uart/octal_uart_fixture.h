// SPDX-License-Identifier: MIT
// OctalUartTest: the driver of an octal UART on a device model, and ports of it.
#pragma once

#include <condition_variable>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <map>
#include <memory>
#include <mutex>

#include <mpf/drivers/industry_pack/model_carrier.h>

#include "drivers/octal_uart/octal_uart_line.h"
#include "drivers/octal_uart/octal_uart_model.h"
#include "drivers/octal_uart/octal_uart_port.h"
#include "tests/drivers/serial/line_collector.h"
#include "tests/support/watchdog.h"

namespace mpf::test {

// Counts the alarms of a module.
class AlarmLog {
 public:
  void add(OctalUartAlarm alarm) {
    const std::lock_guard lock(mutex_);
    ++counts_[alarm];
    changed_.notify_all();
  }
  void waitFor(OctalUartAlarm alarm) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return counts_[alarm] > 0; });
  }
  int count(OctalUartAlarm alarm) {
    const std::lock_guard lock(mutex_);
    return counts_[alarm];
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<OctalUartAlarm, int> counts_;
};

// A port and the handler that is bound to it.
struct BoundOctalPort {
  BoundOctalPort(OctalUart& uart, int number, const SerialSettings& settings)
      : owner(openOctalUartPort(uart, number, {.settings = settings})) {}
  LineCollector collector{"\r"};
  std::unique_ptr<SerialPort> owner;
  SerialPort& port{*owner};
  BoundSerialPort line{port, collector};
};

class OctalUartTest : public testing::Test {
 protected:
  static constexpr SerialSettings kFast{38400, 1, 8, 'N', 'N'};

  OctalUartModel& plug(const OctalUartModelOptions& options) {
    model_ = &carrier_.plug("IP_a", std::make_unique<OctalUartModel>(options));
    return *model_;
  }
  // Plugs a model and starts the driver.
  OctalUart& start(const OctalUartModelOptions& model = {}, const OctalUartOptions& options = {}) {
    plug(model);
    uart_.emplace(modules_.create("UART", "ipac", "IP_a", kOctalUart), options);
    uart_->onAlarm(
        [this](OctalUartAlarm alarm, const std::string& /*what*/) { alarms_.add(alarm); });
    return *uart_;
  }
  [[nodiscard]] SerialSettings settingsInChip(int number) const {
    return model_->with(number,
                        [](const OctalUartModelChannel& channel) { return channel.settings(); });
  }
  [[nodiscard]] bool requestsToSend(int number) const {
    return model_->with(
        number, [](const OctalUartModelChannel& channel) { return channel.requestsToSend(); });
  }
  // Returns whether the far end receives a command and the port receives the answer.
  bool echoes(BoundOctalPort& bound, int number) {
    const auto tap = bound.port.attachTap([this, number](std::span<const PeekedByte> bytes) {
      if (bytes.front().direction == ByteDirection::sent) model_->farEndSend(number, "yes\r");
    });
    return bound.line->writeRead(bytesOf("ok?\r"), kWatchdog) == SerialPortStatus::success &&
           bound.collector.answer() == "yes\r";
  }

  Watchdog watchdog_{"octal UART test"};
  AlarmLog alarms_;
  IndustryPackCarriers carriers_;
  ModelCarrier& carrier_ = addCarrier(std::make_unique<ModelCarrier>());
  IndustryPackModules modules_{carriers_};
  OctalUartModel* model_ = nullptr;  // owned by the carrier
  std::optional<OctalUart> uart_;

  ModelCarrier& addCarrier(std::unique_ptr<ModelCarrier> carrier,
                           const std::string& name = "ipac") {
    auto& added = *carrier;
    carriers_.add(name, std::move(carrier));
    return added;
  }
};

}  // namespace mpf::test
