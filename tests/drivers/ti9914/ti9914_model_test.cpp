// SPDX-License-Identifier: MIT
#include "drivers/ti9914/ti9914_model.h"

#include <gtest/gtest.h>
#include <memory>
#include <string>

#include <mpf/drivers/industry_pack/model_carrier.h>

#include "drivers/ti9914/ti9914.h"
#include "tests/drivers/gpib/memory_instrument.h"

namespace mpf::test {
namespace {

// NOLINTNEXTLINE(google-build-using-namespace): the names of the data manual
using namespace ti9914;

// The chip, used register by register; an instrument is at 6: '&' is its listen address, 'F' its
// talk address.
class Ti9914ModelTest : public testing::Test {
 protected:
  Ti9914ModelTest() {
    bus_->attach({6}, instrument_);
    model_ = &carrier_.plug("IP_a", std::make_unique<Ti9914Model>(bus_, [this] { return nowNs_; }));
  }
  std::uint8_t read(Register which) { return io().read8(which); }
  void write(Register which, std::uint8_t value) { io().write8(which, value); }
  void aux(std::uint8_t command) {
    nowNs_ += kAuxSpacingNs;
    write(kAuxcr, command);
  }
  void takeCharge() {
    aux(kSwrst);
    aux(kSic | kSet);
    aux(kSic);
    read(kIsr0);
  }
  void command(std::uint8_t byte) {
    aux(kTca);
    write(kCdor, byte);
    EXPECT_EQ(read(kIsr0) & kBo, kBo);
  }
  [[nodiscard]] bool isActive(gpib_line::Line line) const { return bus_->lines().has(line); }
  [[nodiscard]] bool hasInterrupt() {
    auto& interrupt = carrier_.site(0).interrupt(0);
    interrupt.enable();
    const bool came = interrupt.take() > 0;
    interrupt.disable();
    return came;
  }
  Registers& io() { return carrier_.site(0).io(); }

  std::int64_t nowNs_ = 1'000'000;
  std::shared_ptr<GpibBusModel> bus_ = std::make_shared<GpibBusModel>();
  std::shared_ptr<MemoryInstrument> instrument_ = std::make_shared<MemoryInstrument>();
  ModelCarrier carrier_;
  Ti9914Model* model_ = nullptr;  // owned by the carrier
};

TEST_F(Ti9914ModelTest, DrivesNothingUntilItsResetEnds) {
  aux(kSic | kSet);
  aux(kTca);
  EXPECT_EQ(bus_->lines().control, 0);

  aux(kSwrst);
  EXPECT_EQ(bus_->lines().control, 0);
  aux(kTca);
  EXPECT_EQ(bus_->lines().control, 0) << "not in charge";
}

TEST_F(Ti9914ModelTest, TakesChargeByInterfaceClear) {
  aux(kSwrst);

  aux(kSic | kSet);
  EXPECT_TRUE(isActive(gpib_line::kIfc));
  EXPECT_TRUE(isActive(gpib_line::kAtn));
  EXPECT_EQ(read(kIsr0), kBo);
  EXPECT_EQ(read(kIsr0), 0) << "a read clears the events";
  aux(kSic);

  EXPECT_FALSE(isActive(gpib_line::kIfc));
  EXPECT_TRUE(isActive(gpib_line::kAtn));
  EXPECT_EQ(read(kBsr), bus_->lines().control);
  EXPECT_EQ(read(kAdsr), kAttention);
}

TEST_F(Ti9914ModelTest, DrivesRemoteEnableAndReleasesAllLinesAtAReset) {
  takeCharge();
  aux(kSre | kSet);
  EXPECT_TRUE(isActive(gpib_line::kRen));

  aux(kSwrst | kSet);

  EXPECT_EQ(bus_->lines().control, 0);
}

TEST_F(Ti9914ModelTest, SendsCommandsAndData) {
  takeCharge();
  command('&');
  aux(kTon | kSet);
  aux(kGts);
  EXPECT_EQ(read(kIsr0), kBo);
  EXPECT_EQ(read(kAdsr), kTalkerAddressed);

  write(kCdor, 'a');
  EXPECT_EQ(read(kIsr0), kBo);
  aux(kFeoi);
  write(kCdor, 'b');

  EXPECT_EQ(instrument_->text(), "ab");
  EXPECT_EQ(instrument_->ends, (std::vector{false, true}));
}

TEST_F(Ti9914ModelTest, ReportsWhenNoDeviceAcceptsAndKeepsTheByteForTheNextMode) {
  takeCharge();
  aux(kTon | kSet);
  aux(kGts);
  read(kIsr0);

  write(kCdor, 0x14);

  EXPECT_EQ(read(kIsr0), 0);
  EXPECT_EQ(read(kIsr1), kErr);
  EXPECT_EQ(read(kIsr1), 0);
  aux(kTca);
  EXPECT_EQ(instrument_->log, "clear ") << "it has become a command";
}

TEST_F(Ti9914ModelTest, DiscardsAByteThatIsNotOnTheBus) {
  takeCharge();
  aux(kTon | kSet);
  aux(kGts);
  write(kCdor, 0x14);

  aux(kNbaf);
  aux(kTca);

  EXPECT_EQ(instrument_->log, "");
}

TEST_F(Ti9914ModelTest, OffersAByteUntilItIsAccepted) {
  takeCharge();
  command('&');
  instrument_->accepts = false;
  aux(kTon | kSet);
  aux(kGts);
  read(kIsr0);
  write(kCdor, 'a');
  EXPECT_EQ(read(kIsr0), 0);
  EXPECT_TRUE(isActive(gpib_line::kDav));
  aux(kTcs);
  EXPECT_FALSE(isActive(gpib_line::kAtn)) << "not while a byte is on the bus";

  instrument_->accepts = true;

  EXPECT_EQ(read(kIsr0), 0) << "the handshake goes on after the read";
  EXPECT_EQ(read(kIsr0), kBo);
  aux(kTcs);
  EXPECT_TRUE(isActive(gpib_line::kAtn));
}

TEST_F(Ti9914ModelTest, ReceivesOneByteUntilItIsRead) {
  takeCharge();
  instrument_->send("abc");
  command('F');
  aux(kLon | kSet);
  aux(kGts);

  EXPECT_EQ(read(kIsr0), kBi);
  EXPECT_EQ(instrument_->toSend.size(), 2U);
  EXPECT_EQ(read(kAdsr), kListenerAddressed);
  EXPECT_EQ(read(kDir), 'a');
  EXPECT_EQ(read(kIsr0), kBi);
  EXPECT_EQ(read(kDir), 'b');
  EXPECT_EQ(read(kDir), 'c');
  EXPECT_EQ(read(kIsr0), 0) << "a read of DIR clears its events";
}

TEST_F(Ti9914ModelTest, HoldsOffAfterEachByte) {
  takeCharge();
  instrument_->send("ab");
  command('F');
  aux(kHdfa | kSet);
  aux(kLon | kSet);
  aux(kGts);

  EXPECT_EQ(read(kDir), 'a');
  EXPECT_TRUE(isActive(gpib_line::kNrfd));
  EXPECT_EQ(instrument_->toSend.size(), 1U);
  aux(kRhdf);

  EXPECT_EQ(read(kIsr0), kBi | kEnd);
  EXPECT_EQ(read(kDir), 'b');
}

TEST_F(Ti9914ModelTest, HoldsOffAfterEnd) {
  takeCharge();
  instrument_->send("ab");
  instrument_->send("c");
  command('F');
  aux(kHdfe | kSet);
  aux(kLon | kSet);
  aux(kGts);

  EXPECT_EQ(read(kDir), 'a');
  EXPECT_EQ(read(kDir), 'b');

  EXPECT_EQ(instrument_->toSend.size(), 1U);
}

TEST_F(Ti9914ModelTest, InterruptsForEnabledEventsWithAnOddVector) {
  write(kImr0, kBo);
  write(ti9914::kVector, 105);
  takeCharge();
  EXPECT_FALSE(hasInterrupt());
  write(kCdor, '?');
  EXPECT_TRUE(hasInterrupt());
  EXPECT_EQ(read(kIsr0), kBo | kInt0);
  EXPECT_FALSE(hasInterrupt()) << "the read releases the line";

  write(ti9914::kVector, 104);
  write(kCdor, '?');
  EXPECT_FALSE(hasInterrupt()) << "even vector";
  write(ti9914::kVector, 105);
  EXPECT_TRUE(hasInterrupt());
  aux(kDai | kSet);
  EXPECT_FALSE(hasInterrupt());
  EXPECT_EQ(model_->vector(), 105);
  EXPECT_EQ(read(ti9914::kVector), 105);
}

TEST_F(Ti9914ModelTest, ReportsAServiceRequestOnce) {
  takeCharge();
  write(ti9914::kVector, 105);
  write(kImr1, ti9914::kSrq);
  bus_->access([&](const GpibLines& /*lines*/) { instrument_->requestService(0); });

  EXPECT_TRUE(hasInterrupt());
  EXPECT_EQ(read(kIsr0), kInt1);
  EXPECT_EQ(read(kIsr1), ti9914::kSrq);
  EXPECT_EQ(read(kIsr1), 0);
  EXPECT_TRUE(isActive(gpib_line::kSrq));
}

TEST_F(Ti9914ModelTest, LosesCommandsThatFollowEachOtherTooFast) {
  takeCharge();
  EXPECT_EQ(model_->lostCommands(), 0U);

  aux(kSre | kSet);
  nowNs_ += kAuxSpacingNs - 1;
  write(kAuxcr, kSre);

  EXPECT_EQ(model_->lostCommands(), 1U);
  EXPECT_TRUE(isActive(gpib_line::kRen));
}

TEST_F(Ti9914ModelTest, HasRegistersAtOddAddressesOfTheIoSpaceOnly) {
  EXPECT_EQ(io().read8(0x00), 0xff);
  EXPECT_EQ(io().read8(0x15), 0xff);
  EXPECT_EQ(carrier_.site(0).memory().read8(1), 0xff);
  io().write8(0x12, 7);
  carrier_.site(0).memory().write8(ti9914::kVector, 7);
  EXPECT_NE(model_->vector(), 7);
  EXPECT_EQ(readIdProm(carrier_.site(0).id(), "here").model, 0x14);
}

}  // namespace
}  // namespace mpf::test
