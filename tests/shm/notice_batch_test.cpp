// SPDX-License-Identifier: MIT
// NoticeBatch: one notice for a run of messages on a link.
#include "shm/notice_batch.h"

#include <optional>
#include <thread>
#include <utility>

#include "tests/shm/receiver.h"
#include "tests/shm/shm_fixture.h"

namespace mpf::test {
namespace {

class NoticeBatchTest : public ShmTest {
 protected:
  void TearDown() override {
    one_.reset();
    two_.reset();
    ShmTest::TearDown();
  }

  std::optional<Receiver> one_{std::in_place, backplane_, "one", Offer{.queueSize = 64}};
  std::optional<Receiver> two_{std::in_place, backplane_, "two"};
};

TEST_F(NoticeBatchTest, NotifiesAtItsEnd) {
  {
    const NoticeBatch batch;
    one_->sendOne();
    one_->sendOne();
    EXPECT_FALSE(one_->wasNotified());
  }

  EXPECT_TRUE(one_->wasNotified());
  one_->sendOne();
  EXPECT_TRUE(one_->wasNotified()) << "without a batch, at once";
}

TEST_F(NoticeBatchTest, NotifiesWhenAMessageGoesToAnotherLink) {
  const NoticeBatch batch;
  one_->sendOne();

  two_->sendOne();

  EXPECT_TRUE(one_->wasNotified());
  EXPECT_FALSE(two_->wasNotified());
}

TEST_F(NoticeBatchTest, NotifiesWhenHalfOfTheQueueIsFull) {
  const NoticeBatch batch;
  for (int i = 1; i < 32; ++i) one_->sendOne();
  EXPECT_FALSE(one_->wasNotified());

  one_->sendOne();

  EXPECT_TRUE(one_->wasNotified());
  one_->sendOne();
  EXPECT_FALSE(one_->wasNotified()) << "it begins a new run";
}

TEST_F(NoticeBatchTest, CountsTheMessagesOfARun) {
  const NoticeBatch batch;
  {
    const Link::Batch run(one_->link.client);
    for (int i = 1; i < 32; ++i) one_->sendOne();
  }
  EXPECT_FALSE(one_->wasNotified());

  one_->sendOne();

  EXPECT_TRUE(one_->wasNotified());
}

TEST_F(NoticeBatchTest, GivesADelayedNoticeOnce) {
  NoticeBatch batch;
  one_->sendOne();

  batch.give();

  EXPECT_TRUE(one_->wasNotified());
  batch.give();
  EXPECT_FALSE(one_->wasNotified());
}

TEST_F(NoticeBatchTest, DoesNotDelayTheNoticesOfOtherThreads) {
  const NoticeBatch batch;

  std::thread([this] { one_->sendOne(); }).join();

  EXPECT_TRUE(one_->wasNotified());
}

}  // namespace
}  // namespace mpf::test
