// SPDX-License-Identifier: MIT
// HeldRequests: the limits of what is held for a client, and for all clients of a connection.
#include "router/incoming/held_requests.h"

#include <gtest/gtest.h>
#include <utility>

#include <mpf/message_of.h>

namespace mpf::router::test {
namespace {

HeldRequest request(std::uint32_t id, Deadline takeBefore = Deadline::never()) {
  return {id, takeBefore, Int32Message({.value = 1})};
}
HeldRequest longRequest(std::uint32_t id, std::size_t bytes) {
  return {id, Deadline::never(),
          Char8ArrayMessage::inBuffer(allocateHeapBody(Char8ArrayMessage::bytesFor(bytes)), bytes)};
}

TEST(HeldRequests, AreReturnedInTheirOrder) {
  std::size_t total = 0;
  HeldRequests held(10, total);
  for (std::uint32_t id = 1; id <= 3; ++id) EXPECT_TRUE(held.tryHold(request(id)));
  EXPECT_EQ(total, 3 * request(1).bytes());

  std::uint32_t expected = 0;
  for (const auto& each : held.takeAll()) EXPECT_EQ(each.requestId, ++expected);

  EXPECT_EQ(expected, 3u);
  EXPECT_EQ(total, 0u);
  EXPECT_TRUE(held.takeAll().empty());
}

TEST(HeldRequests, AreNotMoreThanTheQueueOfTheServerHolds) {
  std::size_t total = 0;
  HeldRequests held(2, total);
  EXPECT_TRUE(held.tryHold(request(1)));
  EXPECT_TRUE(held.tryHold(request(2)));
  const auto before = total;
  auto third = request(3);

  EXPECT_FALSE(held.tryHold(std::move(third)));

  EXPECT_TRUE(third.message) << "it is unchanged";
  EXPECT_EQ(total, before);
}

TEST(HeldRequests, OfAClientAreLimitedInBytes) {
  std::size_t total = 0;
  HeldRequests held(10, total);
  EXPECT_TRUE(held.tryHold(longRequest(1, HeldRequests::kMaxBytes - 4096)));

  EXPECT_FALSE(held.tryHold(longRequest(2, 4096)));
  EXPECT_TRUE(held.tryHold(request(3)));
}

TEST(HeldRequests, OfAllClientsAreLimitedInBytes) {
  std::size_t total = HeldRequests::kMaxTotalBytes;
  HeldRequests held(10, total);

  EXPECT_FALSE(held.tryHold(request(1)));

  total = HeldRequests::kMaxTotalBytes - request(1).bytes();
  EXPECT_TRUE(held.tryHold(request(1)));
}

TEST(HeldRequests, MayBeOneOfAnySize) {
  std::size_t total = 0;
  HeldRequests held(0, total);

  EXPECT_TRUE(held.tryHold(longRequest(1, HeldRequests::kMaxTotalBytes)));

  EXPECT_FALSE(held.tryHold(request(2)));
}

TEST(HeldRequests, ExpireAtTheirDeadlines) {
  std::size_t total = 0;
  HeldRequests held(10, total);
  const auto later = Deadline::after(std::chrono::hours(1));
  EXPECT_EQ(held.nextDeadline(), Deadline::never());
  EXPECT_TRUE(held.tryHold(request(1, Deadline::after(Nanoseconds(0)))));
  EXPECT_TRUE(held.tryHold(request(2, later)));
  EXPECT_TRUE(held.tryHold(request(3)));
  EXPECT_TRUE(held.tryHold(request(4, Deadline::after(Nanoseconds(0)))));

  const auto expired = held.takeExpired();

  ASSERT_EQ(expired.size(), 2u);
  EXPECT_EQ(expired[0].requestId, 1u);
  EXPECT_EQ(expired[1].requestId, 4u);
  EXPECT_EQ(held.nextDeadline(), later);
  EXPECT_EQ(total, 2 * request(1).bytes());
  const auto rest = held.takeAll();
  ASSERT_EQ(rest.size(), 2u);
  EXPECT_EQ(rest[0].requestId, 2u);
  EXPECT_EQ(rest[1].requestId, 3u);
}

TEST(HeldRequests, AreNoLongerCountedWhenTheirClientIsDestroyed) {
  std::size_t total = 5;
  {
    HeldRequests held(10, total);
    EXPECT_TRUE(held.tryHold(request(1)));
  }
  EXPECT_EQ(total, 5u);
}

}  // namespace
}  // namespace mpf::router::test
