// SPDX-License-Identifier: MIT
// The device model, register by register; digital_io_kind.h describes the registers.
#include <mpf/drivers/industry_pack/model_wires.h>

#include "digital_io_fixture.h"
#include "tests/support/temporary_folder.h"

namespace mpf::test {
namespace {

namespace word = digital_io_word;
using testing::ElementsAre;
using testing::Pair;

class DigitalIoModelTest : public testing::Test {
 protected:
  std::uint16_t read(std::size_t word) {
    return model_.read(DeviceModel::Space::io, 2 * word, DeviceModel::kBoth);
  }
  void write(std::size_t word, std::uint16_t value) {
    model_.write(DeviceModel::Space::io, 2 * word, value, DeviceModel::kBoth);
  }
  void watchInterrupt() {
    model_.connectInterrupts([this](int number, bool active) {
      EXPECT_EQ(number, 0);
      isAsking_ = active;
    });
  }
  DigitalIoModel model_{*findDigitalIoKind("IP-Unidig-I")};
  bool isAsking_ = false;
};

// Bits without a function read as ones, since nothing drives them.
TEST_F(DigitalIoModelTest, HasOnesInItsOutputsAtPowerUpAndZeroesElsewhere) {
  write(word::kOutput + 1, 0);
  model_.setInputs(0xffffffff, 0);
  EXPECT_EQ(read(word::kOutput), 0xffff);
  EXPECT_EQ(read(word::kOutput + 1), 0xff00);
  EXPECT_EQ(read(word::kInput), 0);
  EXPECT_EQ(read(word::kInput + 1), 0xff00);
  for (const auto one : {6U, 9U, 11U, 13U}) EXPECT_EQ(read(one), 0) << one;
  for (const auto one : {8U, 10U, 12U, 14U}) EXPECT_EQ(read(one), 0xff00) << one;
  for (const auto one : {4U, 5U, 7U, 15U}) EXPECT_EQ(read(one), 0xffff) << one;
}

TEST_F(DigitalIoModelTest, PullsALineDownByAZeroOnly) {
  model_.setInputs(0xf, 0x3);
  write(word::kOutput, 0xfffa);
  EXPECT_EQ(read(word::kInput), 0xfff2);
  EXPECT_EQ(model_.driven(), 0x5u);
}

TEST_F(DigitalIoModelTest, RequestsAnInterruptAtAnEnabledEdgeUntilItIsCleared) {
  watchInterrupt();
  write(word::kPolarity, 0x1);
  write(word::kInterruptEnable, 0x3);
  model_.setInputs(0x7, 0x1);  // bit 0 was high, bit 1 falls, bit 2 is not enabled
  EXPECT_TRUE(isAsking_);
  EXPECT_EQ(read(word::kPending), 0x2);
  EXPECT_EQ(read(word::kPending), 0x2);

  write(word::kPending, 0x1);
  EXPECT_TRUE(isAsking_);
  write(word::kPending, 0x2);
  EXPECT_FALSE(isAsking_);

  model_.setInputs(0x1, 0);
  EXPECT_FALSE(isAsking_);
  model_.setInputs(0x1, 1);
  EXPECT_TRUE(isAsking_);
  EXPECT_EQ(read(word::kPending), 0x1);
  write(word::kInterruptEnable, 0);
  EXPECT_FALSE(isAsking_);
}

TEST_F(DigitalIoModelTest, SeesEdgesOfItsOwnOutputs) {
  watchInterrupt();
  write(word::kInterruptEnable + 1, 0x80);
  write(word::kOutput + 1, 0x7f);
  EXPECT_TRUE(isAsking_);
  EXPECT_EQ(read(word::kPending + 1), 0xff80);
}

TEST_F(DigitalIoModelTest, HasNoInterruptRegistersWithoutInterrupts) {
  DigitalIoModel plain(*findDigitalIoKind("IP-Unidig"));
  for (const auto word : {8U, 9U, 10U, 11U, 12U}) {
    plain.write(DeviceModel::Space::io, 2 * word, 0xff, DeviceModel::kBoth);
    EXPECT_EQ(plain.read(DeviceModel::Space::io, 2 * word, DeviceModel::kBoth), 0xffff) << word;
  }
}

TEST(DigitalIoModel, ReportsTheVoltagesOfItsOutputs) {
  std::vector<std::pair<int, double>> told;
  DigitalIoModel model(*findDigitalIoKind("IP-Unidig-HV-16I8O"),
                       [&](int bit, double volts) { told.emplace_back(bit, volts); });
  EXPECT_EQ(told.size(), 8u);
  told.clear();

  model.write(DeviceModel::Space::io, 2, 0xee, DeviceModel::kLow);
  model.write(DeviceModel::Space::io, 2, 0x0f, DeviceModel::kBoth);

  EXPECT_THAT(told, ElementsAre(Pair(16, 0.0), Pair(20, 0.0), Pair(16, 5.0), Pair(21, 0.0),
                                Pair(22, 0.0), Pair(23, 0.0)));
}

// Two modules, as in two programs: inputs of one follow outputs of the other.
TEST_F(DigitalIoTest, FollowsAnotherModuleOverWires) {
  const TemporaryFolder folder;
  ModelWires wires(folder.file("wires"));
  DigitalIoModel other(*findDigitalIoKind("DIO316I"), [&](int bit, double volts) {
    wires.wire("dio." + std::to_string(bit)).set(volts);
  });
  auto& io =
      start("IP-Unidig-I", {.pollEvery = kNever, .vector = 1, .rising = 0xf, .falling = 0xf});
  model_->connect(2, [wire = wires.wire("dio.17")] { return wire.get(); });
  const ModelWireWatcher watcher(wires, [&] { model_->look(); });
  other.write(DeviceModel::Space::io, 2 * word::kSystranEnable, 0xf, DeviceModel::kBoth);
  DigitalIoListener listener(io);

  for (int i = 0; i < 20; ++i) {
    other.write(DeviceModel::Space::io, 2, i % 2 == 0 ? 0 : 2, DeviceModel::kBoth);
    EXPECT_EQ(listener.next().inputs & 4, i % 2 == 0 ? 0u : 4u);
  }
  model_->connect(2, {});  // the wires are destroyed before the model
}

}  // namespace
}  // namespace mpf::test
