// SPDX-License-Identifier: MIT
#include "server/programs/gpib_server/request_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thread>

#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;

class GpibRequestQueueTest : public testing::Test {
 protected:
  // `number` identifies the request.
  void push(GpibUser client, std::int32_t number, Deadline until = Deadline::never()) {
    GpibWork work{Char8ArrayMessage::allocValue(0), client, {.command = number, .until = until}};
    queue_.push(std::move(work));
  }
  // The numbers of all requests that may be taken, in their order.
  std::vector<std::int32_t> takeAll(GpibUser holder = 0) {
    std::vector<std::int32_t> numbers;
    while (const auto work = queue_.tryTake(holder)) numbers.push_back(work->request.command);
    return numbers;
  }

  Watchdog watchdog_{"request queue test"};
  GpibRequestQueue queue_;
};

TEST_F(GpibRequestQueueTest, ClientsTakeTurns) {
  for (const auto number : {10, 11, 12}) push(1, number);
  for (const auto number : {20, 21}) push(2, number);
  push(3, 30);

  EXPECT_THAT(takeAll(), ElementsAre(10, 20, 30, 11, 21, 12));
}

TEST_F(GpibRequestQueueTest, AClientThatKeepsAskingDoesNotDelayAnother) {
  push(1, 10);
  push(1, 11);
  ASSERT_EQ(queue_.tryTake(0)->request.command, 10);
  push(2, 20);
  push(1, 12);

  EXPECT_THAT(takeAll(), ElementsAre(11, 20, 12));
}

TEST_F(GpibRequestQueueTest, DuringALeaseOnlyItsHolderIsServed) {
  push(1, 10);
  push(2, 20);
  push(2, 21);

  EXPECT_THAT(takeAll(2), ElementsAre(20, 21));
  EXPECT_THAT(takeAll(3), IsEmpty());
  EXPECT_THAT(takeAll(), ElementsAre(10));
}

TEST_F(GpibRequestQueueTest, RequestsExpireAtTheirDeadlines) {
  const auto soon = Deadline::atNs(Clock::nowNs());
  const auto later = Deadline::after(1h);
  push(1, 10, later);
  push(1, 11, soon);
  push(2, 20, soon);
  EXPECT_EQ(queue_.nextExpiry(), soon);

  std::vector<std::int32_t> expired;
  for (const auto& work : queue_.takeExpired()) expired.push_back(work.request.command);

  EXPECT_THAT(expired, ElementsAre(11, 20));
  EXPECT_EQ(queue_.nextExpiry(), later);
  EXPECT_THAT(queue_.takeExpired(), IsEmpty());
  EXPECT_THAT(takeAll(), ElementsAre(10));
}

TEST_F(GpibRequestQueueTest, RequestsOfAGoneClientAreDropped) {
  push(1, 10);
  push(2, 20);
  push(2, 21);
  push(3, 30);

  queue_.removeGone([](const GpibWork& work) { return work.client == 2; });

  EXPECT_THAT(takeAll(), ElementsAre(10, 30));
}

TEST_F(GpibRequestQueueTest, AWaitEndsAtAPushAWakeOrItsDeadline) {
  queue_.wake();
  queue_.wait(Deadline::never());
  push(1, 10);
  queue_.wait(Deadline::never());
  queue_.wait(Deadline::after(1ms));

  std::thread beside([this] { push(1, 11); });
  queue_.wait(Deadline::never());
  beside.join();
}

}  // namespace
}  // namespace mpf::test
