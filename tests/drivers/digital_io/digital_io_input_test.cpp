// SPDX-License-Identifier: MIT
#include <random>
#include <thread>

#include "digital_io_fixture.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

DigitalIoOptions interruptsOnly(std::uint32_t rising, std::uint32_t falling) {
  return {.pollEvery = std::chrono::hours(1), .vector = 0x74, .rising = rising, .falling = falling};
}

TEST_F(DigitalIoTest, SeesChangesByPolling) {
  for (const auto* const name : {"IP-Unidig", "DIO316I", "IP-Unidig-I"}) {
    auto& io = start(name, {.pollEvery = 1ms});
    DigitalIoListener listener(io);
    model_->setInputs(0xffff, 0xfffe);
    EXPECT_EQ(listener.next().changed, 1u) << name;
    model_->setInputs(0xffff, 0x7ffe);
    EXPECT_EQ(listener.next().changed, 0x8000u) << name;
    EXPECT_EQ(io.counters().interrupts, 0u) << name;
  }
}

TEST_F(DigitalIoTest, SeesBothEdgesByInterrupt) {
  auto& io = start("IP-Unidig-I", interruptsOnly(0xffffff, 0xffffff));
  EXPECT_TRUE(io.usesInterrupts());
  EXPECT_EQ(model_->vector(), 0x74);
  DigitalIoListener listener(io);
  for (int i = 0; i < 100; ++i) {
    model_->setInputs(0x800001, i % 2 == 0 ? 0 : 0x800001);
    const auto inputs = i % 2 == 0 ? 0x7ffffeU : 0xffffffU;
    EXPECT_EQ(listener.waitForInputs(inputs), 0x800001u);
  }
}

TEST_F(DigitalIoTest, InterruptsOnlyForTheSelectedEdges) {
  // bit 0 rising, bit 1 falling, bit 2 both, bit 3 no edges
  auto& io = start("IP-Unidig-I", interruptsOnly(0x5, 0x6));
  model_->setInputs(0xf, 0x0);
  io.look();
  DigitalIoListener listener(io);
  // All changes until one of `bit`: the driver may look between two changes without an interrupt.
  const auto changesUntil = [&](std::uint32_t bit) {
    std::uint32_t changed = 0;
    while ((changed & bit) == 0) changed |= listener.next().changed;
    return changed;
  };

  model_->setInputs(0x8, 0x8);
  model_->setInputs(0x2, 0x2);
  EXPECT_EQ(word(0xd), 0);
  model_->setInputs(0x1, 0x1);

  EXPECT_EQ(changesUntil(0x1), 0xbu) << "includes changes that caused no interrupt";
  model_->setInputs(0x1, 0x0);
  EXPECT_EQ(word(0xd), 0);
  model_->setInputs(0x2, 0x0);
  EXPECT_EQ(changesUntil(0x2), 0x3u);
  model_->setInputs(0x4, 0x4);
  EXPECT_EQ(changesUntil(0x4), 0x4u);
  model_->setInputs(0x4, 0x0);
  EXPECT_EQ(changesUntil(0x4), 0x4u);
}

TEST_F(DigitalIoTest, ReportsAPulseThatHasEnded) {
  auto& io = start("IP-Unidig-I", interruptsOnly(0x1, 0));
  model_->setInputs(0x1, 0);
  io.look();
  DigitalIoListener listener(io);

  model_->setInputs(0x1, 1);
  model_->setInputs(0x1, 0);

  const auto inputs = listener.next();
  EXPECT_EQ(inputs.changed & 1, 1u);
}

TEST_F(DigitalIoTest, AcceptsOtherEdgesLater) {
  auto& io = start("IP-Unidig-I", interruptsOnly(0, 0));
  DigitalIoListener listener(io);
  model_->setInputs(0x3, 0);
  EXPECT_TRUE(listener.isEmpty());

  EXPECT_EQ(io.trySetEdges(0xffffff01, 0), DigitalIoStatus::success);
  EXPECT_EQ(listener.next().changed, 0x3u);
  model_->setInputs(0x1, 1);
  EXPECT_EQ(listener.next().changed, 0x1u);

  EXPECT_EQ(io.trySetEdges(0, 0x1), DigitalIoStatus::success);
  model_->setInputs(0x1, 0);
  EXPECT_EQ(listener.next().changed, 0x1u);
}

TEST_F(DigitalIoTest, RefusesEdgesWithoutInterrupts) {
  EXPECT_EQ(start("IP-Unidig").trySetEdges(1, 1), DigitalIoStatus::noInterrupts);
}

TEST_F(DigitalIoTest, DisablesInterruptsWhenItIsDestroyed) {
  start("IP-Unidig-I", interruptsOnly(0xffffff, 0xffffff));
  EXPECT_EQ(word(9), 0xffff);
  io_.reset();
  EXPECT_EQ(word(9), 0);
  EXPECT_EQ(word(10) & 0xff, 0);
}

// However the lines change, the last report has their final state; without polls, by interrupts
// alone.
TEST_F(DigitalIoTest, ReportsTheFinalStateOfLinesThatChangeAtAnyTime) {
  const auto seed = std::random_device{}();
  SCOPED_TRACE(seed);
  std::mt19937 engine(seed);
  const auto random = [&] { return static_cast<std::uint32_t>(engine()) & 0xffffff; };
  auto& io = start("IP-Unidig-I", interruptsOnly(0xffffff, 0xffffff));
  DigitalIoListener listener(io);
  auto last = 0xffffffU;
  for (int round = 0; round < 200; ++round) {
    for (int i = 0; i < 50; ++i) model_->setInputs(0xffffff, random());
    const auto settled = random();
    model_->setInputs(0xffffff, settled);
    if (settled != last) listener.waitForInputs(settled);
    while (io.look().inputs != settled) std::this_thread::yield();
    while (!listener.isEmpty()) EXPECT_EQ(listener.next().kind, Kind::inputs);
    last = settled;
  }
}

TEST_F(DigitalIoTest, ReportsToEachSubscriberUntilItsSubscriptionEnds) {
  auto& io = start("IP-Unidig-I", interruptsOnly(0xffffff, 0xffffff));
  std::vector<std::unique_ptr<DigitalIoListener>> listeners;
  for (int i = 0; i < 20; ++i) listeners.push_back(std::make_unique<DigitalIoListener>(io));
  model_->setInputs(1, 0);
  for (auto& listener : listeners) EXPECT_EQ(listener->next().changed, 1u);

  listeners.erase(listeners.begin() + 5, listeners.begin() + 10);
  model_->setInputs(2, 0);

  for (auto& listener : listeners) EXPECT_EQ(listener->next().changed, 2u);
}

TEST_F(DigitalIoTest, SeesChangesByPollingWhenInterruptsAreLostAndReportsItOnce) {
  auto options = interruptsOnly(0xffffff, 0xffffff);
  options.pollEvery = 1ms;
  auto& io = start("IP-Unidig-I", options);
  DigitalIoListener listener(io);
  carrier_.setFault("IP_a", ModelFault::interruptsLost);

  model_->setInputs(1, 0);
  EXPECT_EQ(listener.next().changed, 1u);
  EXPECT_EQ(listener.next().kind, Kind::lostInterrupt);
  model_->setInputs(1, 1);
  EXPECT_EQ(listener.next().changed, 1u);
  for (int i = 0; i < 5; ++i) io.look();
  EXPECT_TRUE(listener.isEmpty());

  carrier_.setFault("IP_a", ModelFault::none);
  model_->setInputs(1, 0);
  EXPECT_EQ(listener.next().kind, Kind::inputs);
}

TEST_F(DigitalIoTest, SeesChangesDuringAStormAndReportsIt) {
  auto options = interruptsOnly(0xffffff, 0xffffff);
  options.pollEvery = 1ms;
  options.storm = {.stormLimit = 50, .stormPause = 24h};
  auto& io = start("IP-Unidig-I", options);
  DigitalIoListener listener(io);
  carrier_.setFault("IP_a", ModelFault::interruptStorm);

  EXPECT_EQ(listener.next().kind, Kind::storm);
  model_->setInputs(1, 0);
  EXPECT_EQ(listener.next(Kind::inputs).changed, 1u);
  EXPECT_EQ(io.counters().storms, 1u);
}

TEST_F(DigitalIoTest, ReportsAStormOnceUntilItHasEnded) {
  auto options = interruptsOnly(0xffffff, 0xffffff);
  options.pollEvery = 1ms;
  options.storm = {.stormLimit = 50, .stormPause = 1ms};
  auto& io = start("IP-Unidig-I", options);
  DigitalIoListener listener(io);

  carrier_.setFault("IP_a", ModelFault::interruptStorm);
  while (io.counters().storms < 20) std::this_thread::yield();
  EXPECT_EQ(listener.next().kind, Kind::storm);
  EXPECT_TRUE(listener.isEmpty());

  for (bool isToldAgain = false; !isToldAgain;) {
    carrier_.setFault("IP_a", ModelFault::interruptsLost);
    for (std::uint32_t i = 0; i < 10; ++i) {  // each change is found by a poll
      model_->setInputs(1, i & 1);
      listener.waitForInputs(0xfffffe | (i & 1));
    }
    const auto before = io.counters().storms;
    carrier_.setFault("IP_a", ModelFault::interruptStorm);
    while (io.counters().storms == before) std::this_thread::yield();
    while (!listener.isEmpty()) isToldAgain = isToldAgain || listener.next().kind == Kind::storm;
  }
}

TEST_F(DigitalIoTest, ReportsAnAbsentModuleAndItsReturnAndContinues) {
  auto options = interruptsOnly(0xffffff, 0xffffff);
  options.pollEvery = 1ms;
  auto& io = start("IP-Unidig-I", options);
  DigitalIoListener listener(io);
  model_->setInputs(0xff, 0x0f);
  listener.waitForInputs(0xffff0f);

  carrier_.unplug("IP_a");
  const auto gone = listener.next();
  EXPECT_EQ(gone.kind, Kind::gone);
  EXPECT_EQ(gone.inputs, 0xffff0fu);
  EXPECT_FALSE(io.look().isThere);
  EXPECT_TRUE(listener.isEmpty());

  plug("IP-Unidig-I");
  const auto back = listener.next();
  EXPECT_EQ(back.kind, Kind::back);
  EXPECT_EQ(back.inputs, 0xffffffu);
  EXPECT_EQ(back.changed, 0xf0u);
  EXPECT_EQ(model_->vector(), 0x74);  // programmed again
  const auto interrupts = io.counters().interrupts;
  model_->setInputs(1, 0);
  EXPECT_EQ(listener.next().inputs, 0xfffffeu);
  while (io.counters().interrupts == interrupts) std::this_thread::yield();
}

TEST_F(DigitalIoTest, IsPresentWhenAllInputsAreHigh) {
  auto& io = start("DIO316I", {.pollEvery = 1ms});
  DigitalIoListener listener(io);
  model_->setInputs(0xffff, 0);
  listener.waitForInputs(0);
  model_->setInputs(0xffff, 0xffff);
  listener.waitForInputs(0xffff);
  EXPECT_TRUE(io.look().isThere);
}

TEST_F(DigitalIoTest, WaitsForAModuleThatIsAbsentAtTheStart) {
  start("IP-Unidig-I", {.pollEvery = 1h});
  auto* const module = modules_->find("dio");
  io_.reset();
  carrier_.setFault("IP_a", ModelFault::busError);
  DigitalIo io(*module, {.pollEvery = 1ms});
  DigitalIoListener listener(io);
  EXPECT_FALSE(io.look().isThere);

  carrier_.setFault("IP_a", ModelFault::none);

  EXPECT_EQ(listener.next().kind, Kind::back);
}

}  // namespace
}  // namespace mpf::test
