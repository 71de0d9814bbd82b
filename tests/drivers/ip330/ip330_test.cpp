// SPDX-License-Identifier: MIT
// The board as a whole: subscribers, gains, faults.
#include "drivers/ip330/ip330.h"

#include <set>
#include <stdexcept>

#include "ip330_fixture.h"

namespace mpf::test {
namespace {

TEST(Ip330, EverySubscriberGetsEveryScan) {
  Ip330Board with({.firstChannel = 1, .lastChannel = 3, .secondsBetweenCalibrate = 0});
  with.model.setSignal(2, dcSignal(2.5));
  int first = 0;
  int second = 0;
  {
    const auto one = with.board.subscribe([&](const Ip330Sample& sample) {
      first += sample.isValid(2) && !sample.isValid(0) ? 1 : 100;
    });
    const auto two = with.board.subscribe([&](const Ip330Sample& sample) {
      second += std::abs(sample.corrected[2] - 49152) < 1.5 ? 1 : 100;
    });
    with.scan(5);
  }
  with.scan(1);

  EXPECT_EQ(first, 5);
  EXPECT_EQ(second, 5);
}

TEST(Ip330, AcceptsTheGivenNumberOfSubscribers) {
  Ip330Board with({.maxClients = 1});
  const auto one = with.board.subscribe([](const Ip330Sample&) {});
  EXPECT_THROW(static_cast<void>(with.board.subscribe([](const Ip330Sample&) {})),
               std::length_error);
}

// EPICS ip330 R1-4 read only one half of the mailboxes: a mean of 200 samples had only 100
// different ones.
TEST(Ip330, DifferentialSamplesOfARampAreAllDistinct) {
  Ip330Board with(
      {.type = Ip330Type::differential, .lastChannel = 15, .secondsBetweenCalibrate = 0});
  for (int i = 0; i < 16; ++i) with.model.setSignal(i, [](double seconds) { return seconds * 5; });
  std::array<std::set<int>, 16> seen;
  auto subscription = with.board.subscribe([&](const Ip330Sample& sample) {
    for (std::size_t i = 0; i < seen.size(); ++i) seen[i].insert(sample.raw[i]);
  });

  with.scan(200);
  subscription.reset();

  for (const auto& codes : seen) EXPECT_EQ(codes.size(), 200u);
  EXPECT_EQ(with.board.counters().missed, 0u);
}

TEST(Ip330, RefusesInvalidGainsAndChannels) {
  Ip330Board with({.firstChannel = 2, .lastChannel = 5});
  EXPECT_TRUE(with.board.trySetGain(2, 3));
  EXPECT_EQ(with.board.gain(2), 3);
  EXPECT_FALSE(with.board.trySetGain(2, 4));  // EPICS ip330 accepted this gain
  EXPECT_FALSE(with.board.trySetGain(2, -1));
  EXPECT_FALSE(with.board.trySetGain(1, 0));
  EXPECT_FALSE(with.board.trySetGain(6, 0));
  EXPECT_FALSE(with.board.trySetGain(-1, 0));
}

TEST(Ip330, CanBeSetToAnotherModeAndTime) {
  Ip330Board with({.lastChannel = 1, .secondsBetweenCalibrate = 0});
  EXPECT_EQ(with.board.tryConfigure(Ip330ScanMode::uniformContinuous, Ip330Trigger::input, 2048),
            "");
  EXPECT_DOUBLE_EQ(with.board.microsecondsPerScan(), 2048);
  with.scan(2);
  EXPECT_NE(with.board.tryConfigure(Ip330ScanMode::burstContinuous, Ip330Trigger::input, 1), "");
  EXPECT_DOUBLE_EQ(with.board.microsecondsPerScan(), 2048);
  EXPECT_EQ(with.board.tryConfigure(Ip330ScanMode::burstSingle, Ip330Trigger::input, 0), "");
  const auto before = with.board.counters().scans;
  EXPECT_TRUE(with.board.tryStartConvert());
  while (with.board.counters().scans == before) std::this_thread::yield();
}

TEST(Ip330, ConvertsOnCommandInTheSingleModesOnly) {
  Ip330Board with({.lastChannel = 1});
  EXPECT_FALSE(with.board.tryStartConvert());
  for (const auto mode : {Ip330ScanMode::disable, Ip330ScanMode::uniformContinuous,
                          Ip330ScanMode::convertOnExternalTriggerOnly}) {
    ASSERT_EQ(with.board.tryConfigure(mode, Ip330Trigger::input, 1000), "");
    EXPECT_FALSE(with.board.tryStartConvert()) << toString(mode);
  }
  ASSERT_EQ(with.board.tryConfigure(Ip330ScanMode::uniformSingle, Ip330Trigger::input, 1000), "");
  EXPECT_TRUE(with.board.tryStartConvert());
  with.carrier.unplug("IP_a");
  EXPECT_FALSE(with.board.tryStartConvert());
}

TEST(Ip330, RefusesInvalidSettings) {
  ModelCarrier carrier;
  carrier.plug("IP_a", std::make_unique<Ip330Model>());
  IndustryPackModule module("adc", "a model", carrier.site(0), kIp330);
  EXPECT_THROW(Ip330(module, {.lastChannel = 32}), std::invalid_argument);
}

TEST(Ip330, DisablesTheBoardWhenItIsDestroyed) {
  ModelCarrier carrier;
  carrier.plug("IP_a", std::make_unique<Ip330Model>());
  IndustryPackModule module("adc", "a model", carrier.site(0), kIp330);
  {
    const Ip330 board(module, {});
  }
  EXPECT_EQ(carrier.site(0).io().read16(0) & 0x3700, 0);  // mode and interrupts
}

// ---- faults

class Ip330FaultTest : public testing::Test {
 protected:
  void waitForScans(std::uint64_t scans) {
    const auto before = with_.board.counters().scans;
    while (with_.board.counters().scans < before + scans) std::this_thread::yield();
  }
  Ip330Board with_{
      {.lastChannel = 3, .secondsBetweenCalibrate = 0}, {.isRealTime = true}, kWatchful};
};

TEST_F(Ip330FaultTest, FindsScansByPollingWhenInterruptsAreLost) {
  with_.carrier.setFault("IP_a", ModelFault::interruptsLost);
  with_.notes.waitFor("+the board's interrupts do not come");
  waitForScans(10);
  with_.carrier.setFault("IP_a", ModelFault::none);
  with_.notes.waitFor("-the board's interrupts come");
}

TEST_F(Ip330FaultTest, MasksAStormAndStillDeliversScans) {
  with_.carrier.setFault("IP_a", ModelFault::interruptStorm);
  with_.notes.waitFor("+the board interrupts without a reason");
  waitForScans(10);
  with_.carrier.setFault("IP_a", ModelFault::none);
  with_.notes.waitFor("-the board's interrupt is quiet");
  waitForScans(10);
}

TEST_F(Ip330FaultTest, ABoardThatReadsAllOnesIsAbsentUntilItAnswers) {
  with_.carrier.setFault("IP_a", ModelFault::busError);
  with_.notes.waitFor("+the board is gone");
  EXPECT_FALSE(with_.board.isDelivering());
  EXPECT_NE(with_.board.problem(), "");
  EXPECT_FALSE(with_.board.tryCalibrate());
  with_.carrier.setFault("IP_a", ModelFault::none);
  with_.notes.waitFor("-the board is present again");
  waitForScans(10);
}

// The words of a foreign module drive its outputs, so nothing may be written to it.
class OtherModel final : public DeviceModel {
 public:
  explicit OtherModel(std::atomic<int>& writes)
      : DeviceModel({.manufacturer = kSystran, .model = 0x69}), writes_(writes) {}
  std::uint16_t read(Space /*space*/, std::size_t /*offset*/, Lanes /*lanes*/) override {
    return 2048;
  }
  void write(Space /*space*/, std::size_t /*offset*/, std::uint16_t /*value*/,
             Lanes /*lanes*/) override {
    writes_.fetch_add(1);
  }

 private:
  std::atomic<int>& writes_;
};

TEST(Ip330WithAnotherModule, WritesNothing) {
  std::atomic<int> writes{0};
  {
    Ip330Board with({.lastChannel = 3, .secondsBetweenCalibrate = 0}, {.isRealTime = true},
                    kWatchful);
    with.carrier.unplug("IP_a");
    with.carrier.plug("IP_a", std::make_unique<OtherModel>(writes));
    EXPECT_FALSE(with.board.trySetGain(0, 1));
    EXPECT_FALSE(with.board.tryCalibrate());
    EXPECT_NE(with.board.tryConfigure(Ip330ScanMode::burstSingle, Ip330Trigger::input, 1000), "");
    with.notes.waitFor("+the board is gone");
    EXPECT_FALSE(with.board.isDelivering());
  }
  EXPECT_EQ(writes.load(), 0);
}

TEST(Ip330WithAnotherModule, ContinuesWithTheNextBoardAndItsOwnCalibration) {
  std::atomic<int> writes{0};
  Ip330Board with({.lastChannel = 3, .secondsBetweenCalibrate = 0},
                  {.offsetError = {90}, .isRealTime = true}, kWatchful);
  with.carrier.unplug("IP_a");
  with.carrier.plug("IP_a", std::make_unique<OtherModel>(writes));
  with.notes.waitFor("+the board is gone");
  with.carrier.unplug("IP_a");
  std::atomic<int> samples{0};
  std::atomic<int> wrong{0};
  const auto epoch = with.board.epoch();
  const auto subscription = with.board.subscribe([&](const Ip330Sample& sample) {
    if (sample.epoch == epoch || !sample.isValid(3)) return;
    if (std::abs(sample.corrected[3] - 32768) > 1.5) wrong.fetch_add(1);
    samples.fetch_add(1);
  });

  with.carrier.plug("IP_a", std::make_unique<Ip330Model>(Ip330ModelOptions{.offsetError = {-90}}));

  with.notes.waitFor("-the board is present again");
  while (samples.load() < 10) std::this_thread::yield();
  EXPECT_EQ(wrong.load(), 0);
  EXPECT_EQ(writes.load(), 0);
}

TEST_F(Ip330FaultTest, ABoardThatWasResetIsProgrammedAgain) {
  ASSERT_TRUE(with_.board.trySetGain(0, 2));
  with_.model.powerCycle();
  while (with_.carrier.site(0).io().read8(0x20) != 2) std::this_thread::yield();
  waitForScans(10);
}

TEST_F(Ip330FaultTest, ABoardThatStopsScanningIsSilentUntilItScans) {
  with_.model.setStuck(true);
  while (with_.board.isDelivering()) std::this_thread::yield();
  with_.notes.waitFor("+the board does not scan");
  with_.model.setStuck(false);
  with_.notes.waitFor("-the board scans again");
  waitForScans(10);
}

// Without calibration no sample uses the result, and each calibration stops the scans.
TEST(Ip330WithoutCalibration, DoesNotRepeatAFailedCalibration) {
  auto limits = kWatchful;
  limits.silence = 5ms;
  Ip330Board with({.lastChannel = 3, .secondsBetweenCalibrate = -1}, {.isRealTime = true}, limits);
  with.model.setStuck(true);

  EXPECT_FALSE(with.board.tryCalibrate());

  with.model.setStuck(false);
  const auto before = with.board.counters().scans;
  while (with.board.counters().scans < before + 10) std::this_thread::yield();
  EXPECT_EQ(with.board.counters().calibrations, 1);
}

// Each failed calibration restarts the scans; a restart does not count as a scan.
TEST_F(Ip330FaultTest, ABoardIsSilentWhileItsCalibrationFailsRepeatedly) {
  with_.model.setStuck(true);
  while (with_.board.isDelivering()) EXPECT_FALSE(with_.board.tryCalibrate());
  with_.notes.waitFor("+the board does not scan");
}

}  // namespace
}  // namespace mpf::test
