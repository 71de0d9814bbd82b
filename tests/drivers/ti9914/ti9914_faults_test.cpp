// SPDX-License-Identifier: MIT
// Faults of the bus at random places of an operation: each operation ends with a status, and the
// next one on the healed bus works.
#include <array>
#include <fmt/format.h>

#include "tests/drivers/ti9914/ti9914_fixture.h"
#include "tests/support/random.h"

namespace mpf::test {
namespace {

using Kind = GpibFault::Kind;

class Ti9914FaultsTest : public Ti9914Test {
 protected:
  static constexpr int kFaults = 1000;
  static constexpr int kOperations = 6;

  Ti9914FaultsTest() { start(); }

  std::size_t below(std::size_t limit) { return random_.below(limit); }
  GpibFault randomFault() {
    static constexpr std::array kKinds{Kind::stuckActive, Kind::stuckInactive, Kind::vanished,
                                       Kind::frozen, Kind::neverAccepts};
    const std::array addresses{kMeter, kMemory, kSecond};
    return {.kind = kKinds.at(below(kKinds.size())),
            .lines = static_cast<std::uint8_t>(1U << below(8)),
            .at = addresses.at(below(addresses.size()))};
  }
  GpibStatus perform(std::size_t operation, Deadline deadline) {
    auto& gpib = *controller_;
    switch (operation) {
      case 0:
        return gpib.write(kMemory, bytesOf("0123456789"), true, deadline).status;
      case 1:
        return gpib.write(kSecond, bytesOf("abc"), true, deadline).status;
      case 2:
        return gpib.read(kMeter, {.maxBytes = 100}, deadline).status;
      case 3:
        return gpib.read(kMeter, {.maxBytes = 100, .endOfString = '\n'}, deadline).status;
      case 4:
        return gpib.serialPoll(kMeter, deadline).status;
      default:
        return gpib.trigger(std::array{kMemory, kSecond}, deadline).status;
    }
  }
  // How many changes of the lines the operation causes on a healthy bus.
  std::uint64_t changesOf(std::size_t operation) {
    const auto before = bus_->changes();
    EXPECT_EQ(perform(operation, Deadline::never()), GpibStatus::success);
    return bus_->changes() - before;
  }
  [[nodiscard]] std::string describe(std::size_t operation, const GpibFault& fault,
                                     std::uint64_t place) const {
    return fmt::format("operation {}, fault {} (lines {}, instrument {}) at {}: ", operation,
                       static_cast<int>(fault.kind), namesOfLines(fault.lines), toString(fault.at),
                       place);
  }
  // Whether all instruments work, and the meter sends a reading from its first byte on.
  void expectHealthy(const std::string& after) {
    auto& gpib = *controller_;
    const auto deadline = Deadline::after(std::chrono::minutes(10));
    memory_->received.clear();
    const auto sent = gpib.write(kMemory, bytesOf("hello"), true, deadline);
    EXPECT_TRUE(sent.ok()) << after << sent.reason;
    EXPECT_EQ(memory_->text(), "hello") << after;
    EXPECT_TRUE(gpib.write(kMeter, bytesOf("ID?"), true, deadline).ok()) << after;
    const auto read = gpib.read(kMeter, {.maxBytes = 100}, deadline);
    EXPECT_EQ(textOf(read.data), "HP3458A\r\n") << after << read.reason;
    EXPECT_TRUE(gpib.write(kSecond, bytesOf("x"), true, deadline).ok()) << after;
  }

  Random random_;
};

TEST_F(Ti9914FaultsTest, EndsEachOperationWithAStatusAndWorksAfterEachFault) {
  std::array<std::uint64_t, kOperations> changes{};
  for (std::size_t i = 0; i < kOperations; ++i) changes.at(i) = changesOf(i);
  std::array<int, 6> ends{};
  int late = 0;
  for (int round = 0; round < kFaults && !HasFailure(); ++round) {
    const auto operation = below(kOperations);
    const auto fault = randomFault();
    const auto place = 1 + below(changes.at(operation));
    bus_->setFaultAfter(place, fault);
    const auto deadline = Deadline::after(std::chrono::milliseconds(2));

    const auto status = perform(operation, deadline);

    EXPECT_TRUE(status != GpibStatus::timeout || deadline.hasPassed()) << "a timeout came early";
    if (Clock::nowNs() - deadline.ns() > 1'000'000) ++late;
    ++ends.at(static_cast<std::size_t>(status));
    bus_->heal();
    expectHealthy(describe(operation, fault, place));
  }
  fmt::print("{} succeeded, {} timeouts, {} without listener; {} ended more than 1 ms late\n",
             ends.at(0), ends.at(1), ends.at(2), late);
  EXPECT_GT(ends.at(1), 0);
  EXPECT_EQ(model_->lostCommands(), 0U);
}

}  // namespace
}  // namespace mpf::test
