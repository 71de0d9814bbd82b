// SPDX-License-Identifier: MIT
#include "server/programs/gpib_server/service_subscriptions.h"

#include <thread>

#include "tests/server/programs/gpib_server/gpib_fixture.h"

namespace mpf::test {
namespace {

using namespace gpib;

class ServiceSubscriptionsTest : public GpibServerTest {
 protected:
  static constexpr std::uint8_t kRequest = kGpibRequestsService;

  void subscribe(GpibAsker& asker, std::int32_t address) const {
    ASSERT_EQ(asker.ask(patient(cmdSubscribe, address)).status, gpibStatusOK);
  }
  // Returns after the server has done all that it does for the SRQ of another instrument.
  void letServerPoll(GpibAsker& witness) {
    fake_.setStatus({30}, kRequest);
    EXPECT_EQ(witness.receive().address, 30);
  }
};

TEST_F(ServiceSubscriptionsTest, SubscribersReceiveTheStatusByte) {
  GpibAsker one(backplane_);
  GpibAsker other(backplane_);
  subscribe(one, 22);
  subscribe(other, 22);
  subscribe(other, 503);

  fake_.setStatus({22}, kRequest | 0x10);

  for (auto* const asker : {&one, &other}) {
    const auto notice = asker->receive();
    EXPECT_EQ(notice.cmd, cmdSubscribe);
    EXPECT_EQ(notice.status, gpibStatusOK);
    EXPECT_EQ(notice.address, 22);
    EXPECT_EQ(notice.value, kRequest | 0x10);
    EXPECT_EQ(notice.extra, 0);
  }
  fake_.setStatus({5, 3}, kRequest);
  EXPECT_EQ(other.receive().address, 503);
  EXPECT_FALSE(one.hasMessage());
}

TEST_F(ServiceSubscriptionsTest, SomebodysPollTellsSubscribers) {
  GpibAsker subscriber(backplane_);
  GpibAsker polling(backplane_);
  subscribe(subscriber, 22);
  ASSERT_EQ(polling.ask(leaseFor(86'400'000)).status, gpibStatusOK);  // the server does not poll
  fake_.setStatus({22}, kRequest | 1);

  EXPECT_EQ(polling.ask(patient(cmdSerialPoll)).text, std::string(1, static_cast<char>(0x41)));

  EXPECT_EQ(subscriber.receive().value, 0x41);
}

TEST_F(ServiceSubscriptionsTest, APollWithoutARequestTellsNobody) {
  GpibAsker asker(backplane_);
  subscribe(asker, 22);
  subscribe(asker, 30);
  fake_.setStatus({22}, 0x01);

  EXPECT_EQ(asker.ask(patient(cmdSerialPoll)).text, "\x01");

  letServerPoll(asker);
  EXPECT_FALSE(asker.hasMessage());
}

TEST_F(ServiceSubscriptionsTest, ASubscriptionEndsWithUnsubscribe) {
  GpibAsker asker(backplane_);
  GpibAsker witness(backplane_);
  subscribe(witness, 30);
  for (const auto address : {20, 21, 22}) subscribe(asker, address);
  subscribe(asker, 21);  // a second time

  EXPECT_EQ(asker.ask(patient(cmdUnsubscribe, 21)).status, gpibStatusOK);
  fake_.setStatus({21}, kRequest);
  fake_.setStatus({22}, kRequest);
  EXPECT_EQ(asker.receive().address, 22);
  EXPECT_EQ(asker.ask(patient(cmdUnsubscribe, allInstruments)).status, gpibStatusOK);
  fake_.setStatus({20}, kRequest);

  letServerPoll(witness);
  EXPECT_FALSE(asker.hasMessage());
}

TEST_F(ServiceSubscriptionsTest, DuringALeaseInstrumentsOfItsHolderArePolled) {
  GpibAsker holder(backplane_);
  GpibAsker other(backplane_);
  subscribe(holder, 22);
  subscribe(other, 21);
  ASSERT_EQ(holder.ask(leaseFor(86'400'000)).status, gpibStatusOK);

  fake_.setStatus({21}, kRequest);
  fake_.setStatus({22}, kRequest);

  EXPECT_EQ(holder.receive().address, 22);
  EXPECT_FALSE(hasOperation("poll 21"));
  ASSERT_EQ(holder.ask(patient(cmdUnlease)).status, gpibStatusOK);
  EXPECT_EQ(other.receive().address, 21);
}

TEST_F(ServiceSubscriptionsTest, OthersWorkWhileTheLineStaysActive) {
  GpibAsker asker(backplane_);
  subscribe(asker, 22);
  fake_.setStatus({4}, kRequest);  // nobody subscribes to it
  while (!hasOperation("poll 22")) std::this_thread::yield();

  EXPECT_EQ(asker.ask(patient(cmdWriteRead), "x").text, "x");

  fake_.setStatus({22}, kRequest);
  EXPECT_EQ(asker.receive().address, 22);
}

TEST_F(ServiceSubscriptionsTest, TheLineIsNotWatchedWithoutSubscribers) {
  {
    GpibAsker asker(backplane_);
    subscribe(asker, 22);
    fake_.setStatus({4}, kRequest);
    while (fake_.linePolls < 3) std::this_thread::yield();
  }
  GpibAsker witness(backplane_);
  int polls = 0;
  do {  // until the server has noticed that the client is gone
    polls = fake_.linePolls;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  } while (polls != fake_.linePolls);
}

// More notices than fit into the client's queue.
TEST_F(ServiceSubscriptionsTest, AClientThatDoesNotReceiveLearnsHowManyAreMissing) {
  GpibAsker idle(backplane_);
  GpibAsker polling(backplane_);
  subscribe(idle, 22);
  constexpr int kNotices = 1000;
  for (int i = 0; i < kNotices; ++i) {
    fake_.setStatus({22}, kRequest);
    polling.ask(patient(cmdSerialPoll));
  }

  int received = 0;
  int missing = 0;
  while (idle.hasMessage()) ++received;
  EXPECT_LT(received, kNotices);
  for (int i = 0; i < 2; ++i) {
    fake_.setStatus({22}, kRequest);
    missing += idle.receive().extra;
  }

  EXPECT_GT(missing, 0);
}

}  // namespace
}  // namespace mpf::test
