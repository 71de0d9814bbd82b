// SPDX-License-Identifier: MIT
// DigitalIoTest: a device model on a carrier, its driver, and a listener that records what it
// reports.
#pragma once

#include <condition_variable>
#include <deque>
#include <gmock/gmock.h>
#include <memory>
#include <mutex>
#include <string>

#include "drivers/digital_io/digital_io.h"
#include "drivers/digital_io/digital_io_model.h"
#include "tests/drivers/industry_pack/plain_model.h"
#include "tests/support/model_carrier.h"
#include "tests/support/watchdog.h"

namespace mpf::test {

// Records all reports of the driver.
class DigitalIoListener {
 public:
  explicit DigitalIoListener(DigitalIo& io)
      : subscription_(io.subscribe([this](const DigitalIoChange& change) { record(change); })) {}

  // Waits for the next report.
  DigitalIoChange next() {
    std::unique_lock lock(mutex_);
    came_.wait(lock, [&] { return !changes_.empty(); });
    const auto change = changes_.front();
    changes_.pop_front();
    return change;
  }
  // Waits for a report of this kind.
  DigitalIoChange next(DigitalIoChange::Kind kind) {
    for (;;) {
      if (const auto change = next(); change.kind == kind) return change;
    }
  }
  // Waits for a report of these inputs. Returns all bits that have changed until then.
  std::uint32_t waitForInputs(std::uint32_t inputs) {
    for (std::uint32_t changed = 0;;) {
      const auto change = next();
      changed |= change.changed;
      if (change.kind == DigitalIoChange::Kind::inputs && change.inputs == inputs) return changed;
    }
  }
  bool isEmpty() {
    const std::lock_guard lock(mutex_);
    return changes_.empty();
  }

 private:
  void record(const DigitalIoChange& change) {
    const std::lock_guard lock(mutex_);
    changes_.push_back(change);
    came_.notify_one();
  }
  std::mutex mutex_;
  std::condition_variable came_;
  std::deque<DigitalIoChange> changes_;
  DigitalIo::Subscription subscription_;  // last: ends before the members that it uses
};

class DigitalIoTest : public testing::Test {
 protected:
  using Kind = DigitalIoChange::Kind;
  static constexpr auto kNever = std::chrono::hours(1);  // period of polls

  // Starts a module with this name and its driver, in place of the previous one, whose listeners
  // must have ended.
  DigitalIo& start(const std::string& name,
                   const DigitalIoOptions& options = {.pollEvery = kNever}) {
    io_.reset();
    carrier_.unplug("IP_a");
    plug(name);
    modules_ = std::make_unique<IndustryPackModules>(carriers_);
    auto& module = modules_->create("dio", "ipac", "IP_a", digitalIoModules());
    io_ = std::make_unique<DigitalIo>(module, options);
    return *io_;
  }
  DigitalIoModel& plug(const std::string& name) {
    model_ = &carrier_.plug("IP_a", std::make_unique<DigitalIoModel>(*findDigitalIoKind(name)));
    return *model_;
  }
  // Switches the power of the module off and on.
  void plugAgain(const std::string& name) {
    carrier_.unplug("IP_a");
    plug(name);
  }
  int threshold() { return word(digital_io_word::kThreshold) & kMaxThreshold; }
  // Reads a register without the driver.
  std::uint16_t word(std::size_t at) { return carrier_.site(0).io().read16(2 * at); }

  Watchdog watchdog_{"digital io test"};
  IndustryPackCarriers carriers_;
  ModelCarrier& carrier_ = addModelCarrier(carriers_);
  DigitalIoModel* model_ = nullptr;
  std::unique_ptr<IndustryPackModules> modules_;
  std::unique_ptr<DigitalIo> io_;
};

}  // namespace mpf::test
