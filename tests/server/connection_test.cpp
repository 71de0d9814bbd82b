// SPDX-License-Identifier: MIT
// Connection: objects are reused, and each remembers which requests have no reply.
#include "server/connection.h"

#include <gtest/gtest.h>

#include "tests/base/child_process.h"

namespace mpf::test {
namespace {

TEST(ConnectionTest, AFreeObjectIsReused) {
  auto first = Connection::take();
  auto* const object = first.get();
  const auto second = Connection::take();
  EXPECT_NE(second.get(), object) << "in use";

  first.reset();

  EXPECT_EQ(Connection::take().get(), object);
}

TEST(ConnectionTest, AFreeObjectHasANewLockInTheChildOfAFork) {
  auto former = Connection::take();
  auto* const object = former.get();
  former.reset();  // the object is free again
  const auto inherited = object->lock;

  const auto status = endOf([&] {
    const auto connection = Connection::take();
    EXPECT_EQ(connection.get(), object);
    EXPECT_NE(connection->lock, inherited) << "another thread may have held it at the fork";
    EXPECT_EQ(Connection::tryOf(connection->routeOf(3, nullptr)), object);
    return testing::Test::HasFailure() ? 1 : 0;
  });

  EXPECT_EQ(status, 0);
}

TEST(ConnectionTest, ARouteLeadsToItsConnection) {
  const auto connection = Connection::take();
  connection->generation = 7;

  const auto route = connection->routeOf(3, nullptr);

  EXPECT_EQ(&Connection::of(route), connection.get());
  EXPECT_EQ(route.requestId, 3u);
  EXPECT_FALSE(connection->isOpenFor(route)) << "it has no client";
}

TEST(ConnectionTest, ClientsOfOneIndexHaveDifferentNumbers) {
  const auto connection = Connection::take();
  const auto former = connection->client();

  ++connection->clientGeneration;

  EXPECT_NE(connection->client(), former);
  EXPECT_NE(former, 0u);
}

TEST(ConnectionTest, FindsAnUnansweredRequestByItsFullId) {
  const auto connection = Connection::take();
  connection->unanswered = std::vector<std::atomic<std::uint64_t>>(8);
  connection->unansweredMask = 7;

  ASSERT_TRUE(connection->tryNoteRequest(9));

  EXPECT_TRUE(connection->isUnanswered(9));
  EXPECT_FALSE(connection->isUnanswered(1)) << "has the same place";
  EXPECT_FALSE(connection->isUnanswered(2));
  EXPECT_FALSE(connection->isUnanswered(0)) << "means no request";
}

}  // namespace
}  // namespace mpf::test
