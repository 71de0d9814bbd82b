// SPDX-License-Identifier: MIT
#include "client/untaken_requests.h"

#include <gmock/gmock.h>
#include <vector>

#include <mpf/message_of.h>

namespace mpf::test {
namespace {

void add(UntakenRequests& requests, std::uint32_t id, std::int64_t deadlineNs = 0) {
  Request request;
  request.id = id;
  request.deadlineNs = deadlineNs;
  request.copy = std::make_unique<Message>(Int32Message({.value = static_cast<int>(id)}));
  EXPECT_TRUE(requests.tryAdd(request));
  EXPECT_EQ(request.copy, nullptr);
}

std::vector<std::uint32_t> idsOf(const UntakenRequests& requests) {
  std::vector<std::uint32_t> ids;
  for (const auto& request : requests.all()) ids.push_back(request.id);
  return ids;
}

TEST(UntakenRequests, AreInTheOrderOfTheirSending) {
  UntakenRequests requests;
  for (const auto id : {5U, 3U, 4U}) add(requests, id);

  EXPECT_THAT(idsOf(requests), testing::ElementsAre(3U, 4U, 5U));
  EXPECT_EQ(requests.front().message->tryAs<Int32>()->value, 3);
}

TEST(UntakenRequests, KeepTheirOrderWhenIdsBeginAgain) {
  UntakenRequests requests;
  for (const auto id : {1U, 0xffff'ffffU, 2U, 0xffff'fffeU}) add(requests, id);

  EXPECT_THAT(idsOf(requests), testing::ElementsAre(0xffff'fffeU, 0xffff'ffffU, 1U, 2U));
}

TEST(UntakenRequests, AreTakenByACondition) {
  UntakenRequests requests;
  add(requests, 1);
  add(requests, 2, 100);
  const auto hasExpired = [](const UntakenRequest& request) { return request.hasExpired(100); };

  EXPECT_EQ(requests.take(hasExpired)->id, 2U);
  EXPECT_FALSE(requests.take(hasExpired));
  requests.removeFront();
  EXPECT_TRUE(requests.isEmpty());
}

TEST(UntakenRequest, ExpiresAtItsDeadline) {
  EXPECT_FALSE(UntakenRequest{.deadlineNs = 100}.hasExpired(99));
  EXPECT_TRUE(UntakenRequest{.deadlineNs = 100}.hasExpired(100));
  EXPECT_FALSE(UntakenRequest{}.hasExpired(100)) << "0 is no deadline";
}

}  // namespace
}  // namespace mpf::test
