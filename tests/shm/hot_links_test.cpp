// SPDX-License-Identifier: MIT
// HotLinks: which links are polled, in which order, and what happens when polling ends.
#include "shm/hot_links.h"

#include <array>
#include <gmock/gmock.h>
#include <memory>
#include <optional>
#include <vector>

#include "base/expedited_barrier.h"
#include "shm/cache_line.h"
#include "tests/shm/endpoint_pair.h"
#include "tests/shm/pinned.h"
#include "tests/shm/shm_fixture.h"

namespace mpf::test {
namespace {

class HotLinksTest : public ShmTest {
 protected:
  void makeLinks(std::uint32_t count) {
    while (links_.size() < count) links_.push_back(connect(*client_, *server_));
  }
  // Polls link `index`, which is one that makeLinks() has made.
  bool tryAdd(std::uint32_t index) { return hot_->tryAdd(index, links_[index].server); }
  std::optional<std::uint32_t> takeReadyBit() {
    return readyBits_.tryTake([](std::uint32_t) { return true; });
  }
  // Whether the peer of the link need not set its ready bit.
  bool isWatched(std::uint32_t index) {
    const auto& control = links_[index].server.control();
    return control.requestWatch.load(std::memory_order_relaxed) != layout::Watch::unwatched;
  }
  void poll(std::uint32_t times) {
    for (std::uint32_t i = 0; i < times; ++i) EXPECT_FALSE(hot_->next());
  }
  void TearDown() override {
    hot_.reset();
    client_.reset();
    server_.reset();
    ShmTest::TearDown();
  }

  std::unique_ptr<layout::WindowHints> hints_ = std::make_unique<layout::WindowHints>();
  ReadyBits readyBits_{*hints_};
  std::optional<HotLinks> hot_{std::in_place, readyBits_, true};
  std::optional<End> server_{std::in_place, backplane_, "server", WaitMode::block};
  std::optional<End> client_{std::in_place, backplane_, "", WaitMode::block};
  std::vector<Connected> links_;
};

TEST_F(HotLinksTest, APolledLinkNeedsNoReadyBits) {
  makeLinks(1);
  EXPECT_FALSE(isWatched(0));

  EXPECT_TRUE(tryAdd(0));
  EXPECT_TRUE(tryAdd(0)) << "polled already";
  EXPECT_EQ(hot_->size(), 1u);
  EXPECT_TRUE(isWatched(0));
  hot_->remove(0);

  EXPECT_EQ(hot_->size(), 0u);
  EXPECT_FALSE(isWatched(0));
  EXPECT_FALSE(takeReadyBit()) << "it has no event";
}

TEST_F(HotLinksTest, AnOwnerThatPollsInWaitsSaysOnWhichProcessor) {
  const Pinned pinned;
  makeLinks(1);
  const auto& polledOn = links_[0].server.control().requestsPolledOn;
  for (const bool pollsInWaits : {true, false}) {
    hot_.emplace(readyBits_, pollsInWaits);
    ASSERT_TRUE(tryAdd(0));
    EXPECT_EQ(polledOn.load(std::memory_order_relaxed), pollsInWaits ? lines::thisProcessor() : 0);

    hot_->remove(0);

    EXPECT_EQ(polledOn.load(std::memory_order_relaxed), 0u);
  }
}

TEST_F(HotLinksTest, LinksWithMessagesTakeTurns) {
  makeLinks(3);
  for (const auto index : {0u, 1u, 2u}) ASSERT_TRUE(tryAdd(index));
  EXPECT_FALSE(hot_->hasMessage());
  for (const auto index : {0u, 2u}) ASSERT_EQ(send(links_[index].client, 1), LinkSend::sent);

  EXPECT_TRUE(hot_->hasMessage());
  const auto first = hot_->next();
  const auto second = hot_->next();

  EXPECT_THAT((std::array{first, second}),
              testing::UnorderedElementsAre(&links_[0].server, &links_[2].server));
  EXPECT_EQ(hot_->next(), first) << "their messages were not taken";
}

TEST_F(HotLinksTest, AnEventIsAnnouncedByTheReadyBitWhenPollingEnds) {
  makeLinks(2);
  for (const auto index : {0u, 1u}) ASSERT_TRUE(tryAdd(index));
  ASSERT_EQ(send(links_[1].client, 1), LinkSend::sent);

  hot_->removeAll();

  EXPECT_EQ(hot_->size(), 0u);
  EXPECT_EQ(takeReadyBit(), 1u);
  EXPECT_FALSE(takeReadyBit());
}

TEST_F(HotLinksTest, TheSlotsOfALinkWithoutAMessageAreFreedWhenPollingEnds) {
  makeLinks(1);
  ASSERT_TRUE(tryAdd(0));
  const auto& freed = links_[0].server.control().requests.freed;
  ASSERT_EQ(send(links_[0].client, 1), LinkSend::sent);
  ASSERT_TRUE(End::tryTake(links_[0].server));
  ASSERT_EQ(freed.load(std::memory_order_relaxed), 0u) << "less than a batch";

  hot_->removeAll();

  EXPECT_EQ(freed.load(std::memory_order_relaxed), 1u);
}

// The endpoint adds a polled link again when its ready bit is set. Its owner then takes a message.
TEST_F(HotLinksTest, TheSlotsOfALinkThatIsAddedAgainAreFreedAtTheNextLook) {
  makeLinks(1);
  ASSERT_TRUE(tryAdd(0));
  poll(5);
  ASSERT_EQ(send(links_[0].client, 1), LinkSend::sent);
  ASSERT_TRUE(tryAdd(0));
  ASSERT_TRUE(End::tryTake(links_[0].server));

  poll(1);

  const auto& freed = links_[0].server.control().requests.freed;
  EXPECT_EQ(freed.load(std::memory_order_relaxed), 1u);
}

TEST_F(HotLinksTest, TheEndOfALinkIsAnEvent) {
  makeLinks(1);
  ASSERT_TRUE(tryAdd(0));
  links_[0].client.setState(layout::LinkState::closed);

  hot_->remove(0);

  EXPECT_EQ(takeReadyBit(), 0u);
}

TEST_F(HotLinksTest, PollingEndsAfterManyPollsWithoutAMessage) {
  makeLinks(1);
  ASSERT_TRUE(tryAdd(0));

  poll(HotLinks::kCoolAfter - 1);
  EXPECT_EQ(hot_->size(), 1u);
  poll(1);

  EXPECT_EQ(hot_->size(), 0u);
  EXPECT_FALSE(isWatched(0));
}

TEST_F(HotLinksTest, AMessageRestartsTheCountOfPolls) {
  makeLinks(1);
  ASSERT_TRUE(tryAdd(0));
  poll(HotLinks::kCoolAfter - 1);
  ASSERT_EQ(send(links_[0].client, 1), LinkSend::sent);

  EXPECT_EQ(hot_->next(), &links_[0].server);
  End::tryTake(links_[0].server);

  poll(HotLinks::kCoolAfter - 1);
  EXPECT_EQ(hot_->size(), 1u);
}

TEST_F(HotLinksTest, ThePeerOfABusyLinkNeedsNoFenceUntilPollingEnds) {
  if (!expedited_barrier::tryRegister()) GTEST_SKIP() << "no membarrier() here";
  makeLinks(1);
  ASSERT_TRUE(tryAdd(0));
  const auto watch = [&] {
    return links_[0].server.control().requestWatch.load(std::memory_order_relaxed);
  };
  const auto exchangeMessages = [&](std::uint32_t times) {
    for (std::uint32_t i = 0; i < times; ++i) {
      ASSERT_EQ(send(links_[0].client, 1), LinkSend::sent);
      ASSERT_EQ(hot_->next(), &links_[0].server);
      End::tryTake(links_[0].server);
    }
  };

  exchangeMessages(HotLinks::kUnfencedAfter - 1);
  EXPECT_EQ(watch(), layout::Watch::polled);
  exchangeMessages(1);
  EXPECT_EQ(watch(), layout::Watch::polledUnfenced);
  hot_->removeAll();

  EXPECT_EQ(watch(), layout::Watch::unwatched);
  EXPECT_FALSE(takeReadyBit());
  ASSERT_EQ(send(links_[0].client, 1), LinkSend::sent);
  EXPECT_TRUE(server_->endpoint.window().hints().readyBits[0].load() != 0) << "hints are back";
}

TEST_F(HotLinksTest, APeerWithoutBarriersKeepsItsFence) {
  makeLinks(1);
  auto& peer = const_cast<layout::SegmentHeader&>(links_[0].server.peer()->header());
  peer.takesBarriers = 0;  // the private copy of the server
  ASSERT_TRUE(tryAdd(0));

  links_[0].server.letPeerSendUnfenced();

  EXPECT_EQ(links_[0].server.control().requestWatch.load(), layout::Watch::polled);
}

TEST_F(HotLinksTest, ABusierLinkReplacesAnIdleOne) {
  constexpr auto kCapacity = static_cast<std::uint32_t>(HotLinks::kCapacity);
  makeLinks(kCapacity + 1);
  for (std::uint32_t index = 0; index < kCapacity; ++index) ASSERT_TRUE(tryAdd(index));

  EXPECT_FALSE(tryAdd(kCapacity)) << "no link has been idle for long";
  poll(HotLinks::kReplaceAfter);
  EXPECT_TRUE(tryAdd(kCapacity));

  EXPECT_EQ(hot_->size(), HotLinks::kCapacity);
  EXPECT_TRUE(isWatched(kCapacity));
}

}  // namespace
}  // namespace mpf::test
