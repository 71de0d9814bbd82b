// SPDX-License-Identifier: MIT
// Ti9914Test: the driver of an IP-488 on its device model, with three instruments on the bus.
#pragma once

#include <chrono>
#include <gtest/gtest.h>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <mpf/drivers/industry_pack/model_carrier.h>
#include <mpf/drivers/industry_pack/module.h>

#include "drivers/gpib/bus_model.h"
#include "drivers/gpib/meter_model.h"
#include "drivers/ti9914/ti9914_controller.h"
#include "drivers/ti9914/ti9914_model.h"
#include "tests/drivers/gpib/memory_instrument.h"
#include "tests/support/watchdog.h"

namespace mpf::test {

class Ti9914Test : public testing::Test {
 protected:
  static constexpr GpibAddress kMeter{22};
  static constexpr GpibAddress kMemory{6};
  static constexpr GpibAddress kSecond{5, 3};
  static constexpr GpibAddress kNobody{9};

  Ti9914Test() {
    bus_->attach(kMeter, meter_);
    bus_->attach(kMemory, memory_);
    bus_->attach(kSecond, second_);
    carriers_.add("ipac", std::move(ownedCarrier_));
    model_ = &carrier_.plug("IP_a", std::make_unique<Ti9914Model>(bus_));
  }

  Ti9914Controller& start(const Ti9914Chip::Options& options = {.vector = 104}) {
    return controller_.emplace(modules_.create("a-ip488", "ipac", "IP_a", kIp488), options);
  }
  static std::vector<std::uint8_t> bytesOf(std::string_view text) {
    return {text.begin(), text.end()};
  }
  static std::string textOf(const std::vector<std::uint8_t>& bytes) {
    return {bytes.begin(), bytes.end()};
  }
  static Deadline soon() { return Deadline::after(std::chrono::milliseconds(20)); }

  Watchdog watchdog_{"TI9914 test"};
  std::shared_ptr<GpibBusModel> bus_ = std::make_shared<GpibBusModel>();
  std::shared_ptr<MeterModel> meter_ = std::make_shared<MeterModel>();
  std::shared_ptr<MemoryInstrument> memory_ = std::make_shared<MemoryInstrument>();
  std::shared_ptr<MemoryInstrument> second_ = std::make_shared<MemoryInstrument>();
  std::unique_ptr<ModelCarrier> ownedCarrier_ = std::make_unique<ModelCarrier>();
  ModelCarrier& carrier_ = *ownedCarrier_;
  IndustryPackCarriers carriers_;
  IndustryPackModules modules_{carriers_};
  Ti9914Model* model_ = nullptr;  // owned by the carrier
  std::optional<Ti9914Controller> controller_;
};

}  // namespace mpf::test
