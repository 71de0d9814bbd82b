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
      : subscription_(io.subscribe([this](const DigitalIoNews& news) { hear(news); })) {}

  // Waits for the next report.
  DigitalIoNews next() {
    std::unique_lock lock(mutex_);
    came_.wait(lock, [&] { return !news_.empty(); });
    const auto news = news_.front();
    news_.pop_front();
    return news;
  }
  // Waits for a report of this kind.
  DigitalIoNews next(DigitalIoNews::Kind kind) {
    for (;;) {
      if (const auto news = next(); news.kind == kind) return news;
    }
  }
  // Waits for a report of these inputs. Returns all bits that have changed until then.
  std::uint32_t waitForInputs(std::uint32_t inputs) {
    for (std::uint32_t changed = 0;;) {
      const auto news = next();
      changed |= news.changed;
      if (news.kind == DigitalIoNews::Kind::inputs && news.inputs == inputs) return changed;
    }
  }
  bool isEmpty() {
    const std::lock_guard lock(mutex_);
    return news_.empty();
  }

 private:
  void hear(const DigitalIoNews& news) {
    const std::lock_guard lock(mutex_);
    news_.push_back(news);
    came_.notify_one();
  }
  std::mutex mutex_;
  std::condition_variable came_;
  std::deque<DigitalIoNews> news_;
  DigitalIo::Subscription subscription_;  // last: ends before the members that it uses
};

class DigitalIoTest : public testing::Test {
 protected:
  using Kind = DigitalIoNews::Kind;
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
