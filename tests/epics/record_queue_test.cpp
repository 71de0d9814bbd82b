// SPDX-License-Identifier: MIT
#include "epics/record_queue.h"

#include <gtest/gtest.h>

#include <mpf/epics/dev_mpf.h>

#include "tests/support/limited_memory.h"

namespace mpf::test {
namespace {

Message reply(std::int32_t value, bool isFirst) {
  Message message = Int32Message({.value = value});
  message.setRoute({0, 1, isFirst ? kEndsRequest : 0, nullptr});
  return message;
}

class RecordQueueTest : public testing::Test {
 protected:
  // The value of the next message, or -1.
  std::int32_t take(bool isRequestOutstanding = false) {
    Message message;
    return queue_.tryTake(message, isRequestOutstanding) ? message.tryAs<Int32>()->value : -1;
  }
  RecordQueue queue_;
};

TEST_F(RecordQueueTest, RequestsOneCallbackForAllMessages) {
  EXPECT_TRUE(queue_.push(reply(1, true)));
  EXPECT_FALSE(queue_.push(reply(2, false)));

  EXPECT_EQ(take(), 1);
  EXPECT_TRUE(queue_.finish(false)) << "a message is left";
  EXPECT_EQ(take(), 2);
  EXPECT_FALSE(queue_.finish(false));
  EXPECT_TRUE(queue_.push(reply(3, true))) << "no callback is pending";
}

TEST_F(RecordQueueTest, KeepsFurtherRepliesBackUntilTheRequestHasEnded) {
  static_cast<void>(queue_.push(reply(1, false)));
  static_cast<void>(queue_.push(reply(2, true)));

  EXPECT_EQ(take(true), 2);
  EXPECT_EQ(take(true), -1);
  EXPECT_FALSE(queue_.finish(true)) << "the callback could do nothing";
  EXPECT_EQ(take(false), 1);
}

TEST_F(RecordQueueTest, ReplacesOnlyFurtherRepliesWhenItIsFull) {
  static_cast<void>(queue_.push(reply(0, true)));
  constexpr auto kMost = static_cast<std::int32_t>(RecordQueue::kMaxMessages);
  for (std::int32_t value = 1; value < 2 * kMost; ++value)
    static_cast<void>(queue_.push(reply(value, false)));

  EXPECT_EQ(queue_.overruns(), static_cast<std::uint64_t>(kMost));
  EXPECT_EQ(take(), 0) << "the first reply";
  for (std::int32_t value = kMost + 1; value < 2 * kMost; ++value) EXPECT_EQ(take(), value);
  EXPECT_EQ(take(), -1);
}

TEST_F(RecordQueueTest, NeverDropsTheEndOfARequest) {
  for (std::int32_t value = 0; value < 1000; ++value)
    static_cast<void>(queue_.push(reply(value, true)));

  for (std::int32_t value = 0; value < 1000; ++value) EXPECT_EQ(take(), value);
  EXPECT_EQ(queue_.overruns(), 0U);
}

// Pushes further replies until one has no memory, and returns the number of those that are kept.
int fillMemory(RecordQueue& queue) {
  int kept = 0;
  for (auto overruns = queue.overruns(); queue.overruns() == overruns; ++kept)
    static_cast<void>(queue.push(reply(kept, false)));
  return kept - 1;
}

TEST_F(RecordQueueTest, WithoutMemoryKeepsTheEndOfTheIOAndTheLastConnect) {
  auto end = reply(1000, true);
  end.setClientType(replyTypeCompleteIO);
  auto other = reply(2000, true);
  other.setClientType(replyTypeReceiveReply);
  int kept = 0;
  {
    const LimitedMemory limit(0);
    kept = fillMemory(queue_);
    static_cast<void>(queue_.push(ConnectMessage({.status = ConnectStatus::connectNo})));
    static_cast<void>(queue_.push(std::move(end)));
    static_cast<void>(queue_.push(std::move(other)));
    static_cast<void>(queue_.push(ConnectMessage({.status = ConnectStatus::connectYes})));
  }

  EXPECT_LT(kept, static_cast<int>(RecordQueue::kMaxMessages)) << "memory was not the limit";
  EXPECT_EQ(queue_.overruns(), 2u) << "a further reply, and the end of another request";
  EXPECT_TRUE(queue_.finish(true));
  EXPECT_EQ(take(true), 1000) << "the record is active";
  for (int value = 0; value < kept; ++value) EXPECT_EQ(take(), value);
  EXPECT_TRUE(queue_.finish(false));
  Message connect;
  ASSERT_TRUE(queue_.tryTake(connect, false));
  ASSERT_NE(connect.tryAs<Connect>(), nullptr);
  EXPECT_EQ(connect.tryAs<Connect>()->status, ConnectStatus::connectYes);
  EXPECT_FALSE(queue_.finish(false));
}

}  // namespace
}  // namespace mpf::test
