// SPDX-License-Identifier: MIT
// A channel on the simulated chip; the test does the work of the interrupt thread.
#include "drivers/octal_uart/octal_uart_channel.h"

#include <poll.h>

#include <gmock/gmock.h>

#include <mpf/drivers/industry_pack/model_carrier.h>

#include "drivers/octal_uart/octal_uart_model.h"
#include "tests/drivers/serial/line_collector.h"

namespace mpf::test {
namespace {

using namespace scc2698b;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr int kNumber = 3;  // channel b of block 1

class OctalUartChannelTest : public testing::Test {
 protected:
  static constexpr SerialSettings kSettings{38400, 1, 8, 'N', 'N'};

  OctalUartModel& plug(OctalUartModelTime time = OctalUartModelTime::instant) {
    model_ = &carrier_.plug("IP_a",
                            std::make_unique<OctalUartModel>(OctalUartModelOptions{.time = time}));
    return *model_;
  }
  OctalUartChannel& open() {
    channel_.open(kSettings);
    return channel_;
  }
  bool serve() { return channel_.serve(kIsrTxRdy | kIsrRxRdy, false); }
  std::vector<LineByte> take() {
    std::vector<LineByte> bytes;
    channel_.take(bytes);
    return bytes;
  }
  [[nodiscard]] bool isRinging() const {
    pollfd bell{channel_.bell(), POLLIN, 0};
    return ::poll(&bell, 1, 0) == 1;
  }
  [[nodiscard]] bool requestsToSend() const {
    return model_->with(kNumber, [](const auto& channel) { return channel.requestsToSend(); });
  }

  ModelCarrier carrier_;
  OctalUartModel* model_ = nullptr;
  std::uint8_t imr_ = 0x05;  // bits of the other channel of the block
  OctalUartChannel channel_{carrier_.site(0).io(), kNumber, false, imr_};
};

TEST_F(OctalUartChannelTest, IsSetUpWhenItIsOpened) {
  plug();
  EXPECT_FALSE(channel_.isOpen());

  open();

  EXPECT_TRUE(channel_.isOpen());
  EXPECT_TRUE(channel_.isAsConfigured());
  EXPECT_EQ(model_->with(kNumber, [](const auto& channel) { return channel.settings(); }),
            kSettings);
  EXPECT_TRUE(requestsToSend());
  EXPECT_EQ(imr_, 0x05 | kIsrRxRdy << 4);
  channel_.close();
  EXPECT_FALSE(requestsToSend());
  EXPECT_EQ(imr_, 0x05) << "the other channel keeps its bits";
}

TEST_F(OctalUartChannelTest, DetectsAResetOfTheChip) {
  plug();
  open();

  model_->reset();

  EXPECT_FALSE(channel_.isAsConfigured());
}

TEST_F(OctalUartChannelTest, ReceivesBytesWithTheirFaultsAndRingsTheBell) {
  plug();
  open();
  EXPECT_FALSE(isRinging());
  model_->farEndSend(kNumber, "ab");
  model_->farEndSend(kNumber, "c", LineFault::parity);
  model_->farEndSend(kNumber, "d", LineFault::framing);

  EXPECT_TRUE(serve());

  EXPECT_TRUE(isRinging());
  EXPECT_THAT(take(), ElementsAre(LineByte{'a'}, LineByte{'b'}, LineByte{'c', LineFault::parity},
                                  LineByte{'d', LineFault::framing}));
  EXPECT_FALSE(isRinging());
  EXPECT_THAT(take(), IsEmpty());
}

TEST_F(OctalUartChannelTest, MarksTheBytesThatMayFollowAGap) {
  auto& model = plug(OctalUartModelTime::stepped);
  open();
  model.farEndSend(kNumber, "abcdef");
  model.advance({});
  model.advance(6 * byteTime(kSettings));

  EXPECT_TRUE(serve());

  EXPECT_THAT(take(),
              ElementsAre(LineByte{'a'}, LineByte{'b'}, LineByte{'c', LineFault::none, true},
                          LineByte{'f', LineFault::none, true}));
  EXPECT_EQ(channel_.takeOverruns(), 1U);
  EXPECT_EQ(channel_.takeOverruns(), 0U);
}

TEST_F(OctalUartChannelTest, CountsBytesThatItsBufferCannotHold) {
  plug();
  open();
  model_->farEndSend(kNumber, std::string(OctalUartChannel::kMaxReceived, 'x') + "lost");
  const auto serveAll = [&] {
    while ((carrier_.site(0).io().read8(at(kNumber, kSr)) & kSrRxRdy) != 0) ASSERT_TRUE(serve());
  };
  serveAll();

  EXPECT_EQ(take().size(), OctalUartChannel::kMaxReceived);
  EXPECT_EQ(channel_.takeOverruns(), 4U);
  model_->farEndSend(kNumber, "ab");
  serveAll();
  EXPECT_THAT(take(), ElementsAre(LineByte{'a', LineFault::none, true}, LineByte{'b'}));
}

TEST_F(OctalUartChannelTest, SendsAndRingsWhenNoByteIsLeft) {
  auto& model = plug(OctalUartModelTime::stepped);
  open();
  EXPECT_EQ(channel_.timeToSend().count(), 0);

  EXPECT_EQ(channel_.put(bytesOf("abc")), 3U);

  EXPECT_EQ(imr_ & kIsrTxRdy << 4, kIsrTxRdy << 4);
  EXPECT_GE(channel_.timeToSend(), byteTime(kSettings));
  EXPECT_FALSE(isRinging());
  model.advance(byteTime(kSettings));
  EXPECT_TRUE(serve());
  EXPECT_TRUE(isRinging());
  EXPECT_EQ(imr_, 0x05 | kIsrRxRdy << 4) << "no interrupt for room without bytes";
  model.advance(2 * byteTime(kSettings));
  EXPECT_EQ(model.farEndReceived(kNumber), "abc");
  EXPECT_EQ(channel_.timeToSend().count(), 0);
}

TEST_F(OctalUartChannelTest, RingsWhenItsBufferHasRoomAgain) {
  auto& model = plug();
  open();
  model.setClearToSend(kNumber, false);
  channel_.configure({38400, 1, 8, 'N', 'H'});
  const std::string much(5000, 'x');
  EXPECT_EQ(channel_.put(bytesOf(much)), OctalUartChannel::kMaxUnsent);
  EXPECT_LE(channel_.put(bytesOf(much)), 2U) << "as many as the chip has taken";
  EXPECT_TRUE(serve());
  EXPECT_FALSE(isRinging());
  model.setClearToSend(kNumber, true);

  for (std::size_t sent = 0; sent < OctalUartChannel::kMaxUnsent / 2; sent += 64)
    EXPECT_TRUE(serve());

  EXPECT_TRUE(isRinging());
  EXPECT_GT(channel_.put(bytesOf(much)), OctalUartChannel::kMaxUnsent / 4);
}

TEST_F(OctalUartChannelTest, DiscardsUnsentBytesAndSendsLaterOnes) {
  auto& model = plug(OctalUartModelTime::stepped);
  open();
  EXPECT_EQ(channel_.put(bytesOf("late")), 4U);

  channel_.discardUnsent();

  EXPECT_EQ(channel_.timeToSend().count(), 0);
  EXPECT_EQ(channel_.put(bytesOf("x")), 1U);
  model.advance(10 * byteTime(kSettings));
  EXPECT_EQ(model.farEndReceived(kNumber), "x");
}

TEST_F(OctalUartChannelTest, KeepsTheFirstReasonOfItsLoss) {
  plug();
  open();

  channel_.lose("no module");
  channel_.lose("another reason");

  EXPECT_FALSE(channel_.isOpen());
  EXPECT_EQ(channel_.lostBecause(), "no module");
  EXPECT_TRUE(isRinging());
  EXPECT_EQ(channel_.timeToSend(), byteTime(kSettings)) << "its bytes are never sent";
  open();
  EXPECT_EQ(channel_.lostBecause(), "");
}

TEST_F(OctalUartChannelTest, ReportsAnAbsentChipAndReceivesNothingFromIt) {
  plug();
  open();
  carrier_.unplug("IP_a");

  EXPECT_FALSE(serve());

  EXPECT_THAT(take(), IsEmpty());
}

// RTS switches the transmitter on.
TEST_F(OctalUartChannelTest, Rs485SendsOrReceives) {
  auto& model = plug(OctalUartModelTime::stepped);
  OctalUartChannel channel(carrier_.site(0).io(), kNumber, true, imr_);
  channel.open(kSettings);
  EXPECT_FALSE(requestsToSend());
  EXPECT_FALSE(channel.waitsForTurn());

  EXPECT_EQ(channel.put(bytesOf("a")), 1U);

  EXPECT_TRUE(requestsToSend());
  EXPECT_TRUE(channel.waitsForTurn());
  model.farEndSend(kNumber, "x");
  channel.tryTurn();
  EXPECT_TRUE(requestsToSend()) << "the byte is not sent yet";
  model.advance({});
  model.advance(byteTime(kSettings));
  EXPECT_NE(channel.timeToSend().count(), 0) << "the transmitter is on";
  channel.tryTurn();
  EXPECT_FALSE(requestsToSend());
  EXPECT_FALSE(channel.waitsForTurn());
  EXPECT_EQ(channel.timeToSend().count(), 0);
  EXPECT_EQ(model.with(kNumber, [](const auto& chip) { return chip.unheard(); }), 1U);
  model.farEndSend(kNumber, "y");
  model.advance({});
  model.advance(byteTime(kSettings));
  EXPECT_TRUE(channel.serve(kIsrRxRdy, false));
  std::vector<LineByte> bytes;
  channel.take(bytes);
  EXPECT_THAT(bytes, ElementsAre(LineByte{'y'}));
}

TEST_F(OctalUartChannelTest, Rs485KeepsTheTransmitterOnDuringABreak) {
  plug();
  OctalUartChannel channel(carrier_.site(0).io(), kNumber, true, imr_);
  channel.open(kSettings);

  channel.setBreak(true);

  EXPECT_TRUE(requestsToSend());
  EXPECT_FALSE(channel.waitsForTurn());
  channel.setBreak(false);
  EXPECT_FALSE(requestsToSend());
}

}  // namespace
}  // namespace mpf::test
