// SPDX-License-Identifier: MIT
// NoticeBatch: one notice for a run of messages to the same receiver.
#include "shm/notice_batch.h"

#include <gtest/gtest.h>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "tests/shm/endpoint_pair.h"
#include "tests/shm/shm_fixture.h"

namespace mpf::test {
namespace {

// A server that sleeps, and the client side of a link to it.
struct Receiver {
  Receiver(const Backplane& backplane, const std::string& name)
      : server(backplane, name, WaitMode::block),
        client(backplane, "", WaitMode::block),
        link(connect(client, server)) {
    static_cast<void>(wasNotified());
  }
  void receives() const { EXPECT_EQ(send(link.client, 1), LinkSend::sent); }
  // Since the last call.
  [[nodiscard]] bool wasNotified() {
    auto& bits = server.endpoint.window().hints().readyBits[0];
    return bits.exchange(0, std::memory_order_relaxed) != 0;
  }

  End server;
  End client;
  Connected link;
};

class NoticeBatchTest : public ShmTest {
 protected:
  void TearDown() override {
    one_.reset();
    two_.reset();
    ShmTest::TearDown();
  }

  std::optional<Receiver> one_{std::in_place, backplane_, "one"};
  std::optional<Receiver> two_{std::in_place, backplane_, "two"};
};

TEST_F(NoticeBatchTest, NotifiesAtItsEnd) {
  {
    const NoticeBatch batch;
    one_->receives();
    one_->receives();
    EXPECT_FALSE(one_->wasNotified());
  }

  EXPECT_TRUE(one_->wasNotified());
  one_->receives();
  EXPECT_TRUE(one_->wasNotified()) << "as before the batch";
}

TEST_F(NoticeBatchTest, NotifiesOneReceiverBeforeItHoldsTheNoticeOfAnother) {
  const NoticeBatch batch;
  one_->receives();

  two_->receives();

  EXPECT_TRUE(one_->wasNotified());
  EXPECT_FALSE(two_->wasNotified());
}

TEST_F(NoticeBatchTest, GivesItsNoticeOnceOnRequest) {
  NoticeBatch batch;
  one_->receives();

  batch.give();

  EXPECT_TRUE(one_->wasNotified());
  batch.give();
  EXPECT_FALSE(one_->wasNotified());
  one_->receives();
  EXPECT_FALSE(one_->wasNotified()) << "a new run";
}

TEST_F(NoticeBatchTest, DoesNotHoldTheNoticesOfOtherThreads) {
  const NoticeBatch batch;

  std::thread([this] { one_->receives(); }).join();

  EXPECT_TRUE(one_->wasNotified());
}

}  // namespace
}  // namespace mpf::test
