// SPDX-License-Identifier: MIT
#include "drivers/digital_io/digital_io.h"

#include <barrier>
#include <thread>

#include <mpf/drivers/industry_pack/industry_pack_error.h>

#include "digital_io_fixture.h"

namespace mpf::test {
namespace {

constexpr auto kSuccess = DigitalIoStatus::success;

TEST_F(DigitalIoTest, KeepsTheOutputsOfThePowerUp) {
  auto& io = start("IP-Unidig");
  EXPECT_EQ(io.tryReadOutputs(), 0xffffffu);
  EXPECT_EQ(io.tryReadInputs(), 0xffffffu);
}

TEST_F(DigitalIoTest, SetsAndClearsTheBitsOfAMaskOnly) {
  auto& io = start("IP-Unidig");

  EXPECT_EQ(io.tryClearBits(0x810001), kSuccess);
  EXPECT_EQ(io.tryReadOutputs(), 0x7efffeu);
  EXPECT_EQ(io.trySetBits(0x800000), kSuccess);
  EXPECT_EQ(io.tryReadOutputs(), 0xfefffeu);
  EXPECT_EQ(io.tryWriteBits(0x0f0f0f, 0x0a0a0a), kSuccess);
  EXPECT_EQ(io.tryReadOutputs(), 0xfafafau);
}

TEST_F(DigitalIoTest, KeepsItsOutputsWhenTheDriverRestarts) {
  ASSERT_EQ(start("IP-Unidig-I", {.vector = 1, .rising = 1}).tryClearBits(0x5), kSuccess);
  io_.reset();

  DigitalIo again(*modules_->find("dio"), {.pollEvery = kNever});

  EXPECT_EQ(again.tryReadOutputs(), 0xfffffau);
}

TEST_F(DigitalIoTest, LosesNoBitWhenManyWriteAtOnce) {
  auto& io = start("IP-Unidig");
  ASSERT_EQ(io.tryClearBits(0xffffff), kSuccess);
  std::barrier begin(4);
  {
    std::vector<std::jthread> writers;
    for (unsigned writer = 0; writer < 4; ++writer) {
      writers.emplace_back([&, writer] {
        const auto mask = 0x3fU << (6 * writer);
        begin.arrive_and_wait();
        for (int i = 0; i < 5000; ++i) {
          EXPECT_EQ(io.tryClearBits(mask), kSuccess);
          EXPECT_EQ(io.trySetBits(mask), kSuccess);
        }
      });
    }
  }
  EXPECT_EQ(io.tryReadOutputs(), 0xffffffu);
}

TEST_F(DigitalIoTest, ReadsLinesThatItDoesNotDrive) {
  auto& io = start("IP-Unidig");
  model_->setInputs(0xff, 0x0f);
  EXPECT_EQ(io.tryReadInputs(), 0xffff0fu);
  ASSERT_EQ(io.tryClearBits(0x3), kSuccess);
  EXPECT_EQ(io.tryReadInputs(), 0xffff0cu);
}

// The first EPICS driver wrote the low enables to word 8, which is the interrupt vector.
TEST_F(DigitalIoTest, EnablesSwitchedDriversInTheOutputEnableRegister) {
  auto& io = start("IP-Unidig-I-D", {.pollEvery = kNever, .vector = 0x74, .rising = 0xff});
  EXPECT_EQ(model_->driven(), 0u);

  ASSERT_EQ(io.tryClearBits(0x000101), kSuccess);
  ASSERT_EQ(io.trySetBits(0x800100), kSuccess);

  EXPECT_EQ(model_->driven(), 0x800101u);
  EXPECT_EQ(model_->vector(), 0x74);
  EXPECT_EQ(word(4), 0x0101);
  EXPECT_EQ(word(5) & 0xff, 0x80);
  EXPECT_EQ(io.tryReadInputs(), 0xfffffeu);
}

TEST_F(DigitalIoTest, SwitchesTheDriversOfOpticalModelsOn) {
  for (const auto* const name :
       {"IP-Unidig-O-24IO", "IP-Unidig-I-O-24IO", "IP-Unidig-O-12I12O", "IP-Unidig-I-O-12I12O"}) {
    ASSERT_EQ(start(name).tryClearBits(0x800000), kSuccess) << name;
    EXPECT_EQ(model_->driven() & 0x800000, 0x800000u) << name;
  }
}

TEST_F(DigitalIoTest, ProgramsADio316I) {
  auto& io = start("DIO316I");
  EXPECT_EQ(word(3), 0xf);
  EXPECT_EQ(word(4), 0x3);
  EXPECT_EQ(io.tryWriteBits(0xffffffff, 0x80000001), kSuccess);
  EXPECT_EQ(io.tryReadOutputs(), 0x80000001u);
  EXPECT_EQ(word(3), 0xf);
  model_->setInputs(0xffff, 0x1234);
  EXPECT_EQ(io.tryReadInputs(), 0x1234u);
}

TEST_F(DigitalIoTest, RefusesBitsThatAModelCannotWriteAndChangesNothing) {
  for (const auto& [name, outputs] :
       std::vector<std::pair<const char*, std::uint32_t>>{{"IP-Unidig", 0xffffff},
                                                          {"IP-Unidig-HV-16I8O", 0xff0000},
                                                          {"IP-Unidig-HV-8I16O", 0xffff00},
                                                          {"IP-Unidig-O-12I12O", 0xfff000},
                                                          {"IP-Unidig-O-24I", 0}}) {
    auto& io = start(name);
    EXPECT_EQ(io.tryClearBits(0xffffffff), DigitalIoStatus::noSuchBits) << name;
    for (std::uint32_t bit = 1; bit != 0; bit <<= 1) {
      if ((outputs & bit) == 0) {
        EXPECT_EQ(io.tryClearBits(outputs | bit), DigitalIoStatus::noSuchBits) << name << bit;
      }
    }
    EXPECT_EQ(io.tryReadOutputs(), outputs) << name;
    EXPECT_EQ(io.tryClearBits(outputs), kSuccess) << name;
    EXPECT_EQ(io.tryReadOutputs(), 0u) << name;
  }
}

// The first EPICS driver omitted one of the four models, had another one twice, and accepted any
// value.
TEST_F(DigitalIoTest, SetsTheThresholdOfModelsThatHaveOne) {
  for (const auto* const name : {"IP-Unidig-HV-16I8O", "IP-Unidig-HV-8I16O", "IP-Unidig-I-HV-16I8O",
                                 "IP-Unidig-I-HV-8I16O"}) {
    auto& io = start(name);
    EXPECT_EQ(threshold(), 166) << name;
    model_->connect(3, [] { return 24.0; });
    EXPECT_EQ(io.tryReadInputs().value_or(0) & 8, 8u) << name;
    EXPECT_EQ(io.trySetThreshold(1601), kSuccess) << name;
    EXPECT_EQ(io.tryReadInputs().value_or(8) & 8, 0u) << name;
    EXPECT_EQ(io.trySetThreshold(-1), DigitalIoStatus::outOfRange);
    EXPECT_EQ(io.trySetThreshold(4096), DigitalIoStatus::outOfRange);
    EXPECT_EQ(threshold(), 1601) << name;
  }
  EXPECT_EQ(start("IP-Unidig-I").trySetThreshold(100), DigitalIoStatus::noThreshold);
}

// Word e of these models is the threshold: clearing interrupts must not change it.
TEST_F(DigitalIoTest, KeepsTheThresholdWhileItServesInterrupts) {
  auto& io = start("IP-Unidig-I-HV-16I8O",
                   {.pollEvery = kNever, .vector = 5, .rising = 0xffffff, .falling = 0xffffff});
  DigitalIoListener listener(io);
  ASSERT_EQ(io.trySetThreshold(100), kSuccess);
  model_->setInputs(0xffff, 0);
  listener.waitForInputs(0);
  model_->setInputs(0xffff, 0x8001);
  listener.waitForInputs(0x8001);
  EXPECT_EQ(threshold(), 100);
}

TEST_F(DigitalIoTest, ReportsARegisterThatHoldsAnotherValue) {
  auto& io = start("IP-Unidig");
  model_->setStuck(0x100);
  EXPECT_EQ(io.trySetBits(0x100), DigitalIoStatus::readBackDiffers);
  EXPECT_EQ(io.trySetBits(0x200), kSuccess);
}

// All ones may be a written value, or the reading of an absent module.
TEST_F(DigitalIoTest, ReportsAnAbsentModule) {
  for (const auto* const name : {"IP-Unidig-HV-16I8O", "DIO316I"}) {
    auto& io = start(name);
    EXPECT_EQ(io.trySetBits(0xff0000), kSuccess);
    carrier_.setFault("IP_a", ModelFault::busError);
    EXPECT_EQ(io.trySetBits(0xff0000), DigitalIoStatus::gone);
    EXPECT_EQ(io.tryClearBits(0xff0000), DigitalIoStatus::gone);
    EXPECT_EQ(io.tryReadInputs(), std::nullopt);
    EXPECT_EQ(io.tryReadOutputs(), std::nullopt);
    EXPECT_EQ(io.trySetThreshold(1), name == std::string("DIO316I") ? DigitalIoStatus::noThreshold
                                                                    : DigitalIoStatus::gone);
    carrier_.setFault("IP_a", ModelFault::none);
    EXPECT_EQ(io.trySetBits(0xff0000), kSuccess);
  }
}

TEST_F(DigitalIoTest, RefusesInvalidVectors) {
  start("IP-Unidig-I");
  for (const int vector : {-1, 256}) {
    try {
      const DigitalIo io(*modules_->find("dio"), {.vector = vector});
      ADD_FAILURE() << vector;
    } catch (const IndustryPackError& error) {
      EXPECT_EQ(error.status(), IndustryPackStatus::badVector) << error.what();
    }
  }
}

// Outputs, enables and threshold are restored after a loss of power; bits that were never written
// are not.
TEST_F(DigitalIoTest, RestoresTheOutputsOfAModuleThatReturns) {
  auto& io = start("IP-Unidig-I-D", {.pollEvery = kNever, .vector = 0x74, .rising = 0xff});
  DigitalIoListener listener(io);
  ASSERT_EQ(io.tryWriteBits(0x810003, 0x800001), kSuccess);
  carrier_.unplug("IP_a");
  EXPECT_FALSE(io.look().isThere);
  plug("IP-Unidig-I-D");
  EXPECT_TRUE(io.look().isThere);

  EXPECT_EQ(model_->outputs(), 0xfefffdu);
  EXPECT_EQ(model_->driven(), 0x810003u);
  EXPECT_EQ(listener.next(Kind::gone).kind, Kind::gone);
  EXPECT_EQ(listener.next().kind, Kind::back);
}

TEST_F(DigitalIoTest, RestoresTheThresholdOfAModuleThatReturns) {
  auto& io = start("IP-Unidig-HV-16I8O");
  ASSERT_EQ(io.trySetThreshold(1601), kSuccess);
  plugAgain("IP-Unidig-HV-16I8O");
  io.look();
  EXPECT_EQ(threshold(), 1601);
}

// A reset between two polls is detected by one register, in each kind of module.
TEST_F(DigitalIoTest, DetectsAResetOfTheModule) {
  for (const auto& kind : digitalIoKinds()) {
    if (kind.outputs == 0) continue;
    const std::string name(kind.name);
    for (const int vector : {0, 0x74}) {
      auto& io = start(name, {.pollEvery = kNever, .vector = vector, .rising = 0xff});
      const auto bit = kind.outputs & ~(kind.outputs - 1);
      ASSERT_EQ(io.tryClearBits(bit), kSuccess) << name;
      DigitalIoListener listener(io);
      plugAgain(name);

      io.look();

      EXPECT_EQ(listener.next().kind, Kind::back) << name;
      EXPECT_EQ(model_->driven() & bit, bit) << name;
      EXPECT_EQ(model_->outputs() & bit, 0u) << name;
      io.look();
      EXPECT_TRUE(listener.isEmpty()) << name;
    }
  }
}

// Other bits of the same register are kept, too.
TEST_F(DigitalIoTest, RestoresAResetModuleBeforeItWrites) {
  auto& io = start("IP-Unidig-I-O-24IO", {.pollEvery = kNever, .vector = 1});
  ASSERT_EQ(io.tryClearBits(0x1), kSuccess);
  plugAgain("IP-Unidig-I-O-24IO");

  EXPECT_EQ(io.tryClearBits(0x2), kSuccess);

  EXPECT_EQ(model_->driven() & 0x3, 0x3u);
  EXPECT_EQ(model_->outputs(), 0xfffffcu);
}

TEST_F(DigitalIoTest, ReportsABrokenRegisterOnce) {
  auto& io = start("IP-Unidig");
  ASSERT_EQ(io.trySetBits(0x100), kSuccess);
  DigitalIoListener listener(io);
  model_->setStuck(0x100);
  model_->write(DeviceModel::Space::io, 0, 0, DeviceModel::kBoth);

  for (int i = 0; i < 3; ++i) io.look();

  EXPECT_EQ(listener.next().kind, Kind::back);
  EXPECT_TRUE(listener.isEmpty());
  EXPECT_EQ(io.trySetBits(0x300), DigitalIoStatus::readBackDiffers);
  io.look();
  EXPECT_EQ(listener.next().kind, Kind::inputs);
  EXPECT_TRUE(listener.isEmpty());
}

TEST_F(DigitalIoTest, WritesNothingToAModuleOfAnotherKind) {
  auto& io = start("IP-Unidig-I-D",
                   {.pollEvery = kNever, .vector = 0x74, .rising = 0xff, .falling = 0xff});
  ASSERT_EQ(io.tryClearBits(0x3), kSuccess);
  carrier_.unplug("IP_a");
  auto& other = carrier_.plug("IP_a", std::make_unique<PlainModel>());

  EXPECT_EQ(io.tryClearBits(0x1), DigitalIoStatus::gone);
  EXPECT_EQ(io.trySetEdges(1, 1), DigitalIoStatus::gone);
  EXPECT_EQ(io.tryReadInputs(), std::nullopt);
  EXPECT_EQ(io.tryReadOutputs(), std::nullopt);
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(io.look().isThere);
  io_.reset();

  for (std::size_t offset = 0; offset < 128; offset += 2)
    EXPECT_EQ(other.read(DeviceModel::Space::io, offset, DeviceModel::kBoth), 0) << offset;
}

// The destructor writes, too; it must check the module itself, since there was no look in between.
TEST_F(DigitalIoTest, WritesNothingToAnotherModuleWhenItIsDestroyed) {
  start("IP-Unidig-I", {.pollEvery = kNever, .vector = 0x74, .rising = 0xff});
  carrier_.unplug("IP_a");
  auto& other = carrier_.plug("IP_a", std::make_unique<PlainModel>());
  other.write(DeviceModel::Space::io, 18, 0x5555, DeviceModel::kBoth);
  io_.reset();
  EXPECT_EQ(other.read(DeviceModel::Space::io, 18, DeviceModel::kBoth), 0x5555);
}

}  // namespace
}  // namespace mpf::test
