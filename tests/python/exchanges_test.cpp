// SPDX-License-Identifier: MIT
// Exchanges: which exchange of a Python program a message belongs to.
#include "python/extension/exchanges.h"

#include <gtest/gtest.h>

namespace mpf::test {
namespace {

using python::Exchange;
using python::Exchanges;

TEST(ExchangesTest, FindsARequestUntilItIsRemoved) {
  Exchanges exchanges;
  Exchange request;
  request.id = 3;
  exchanges.add(request);

  EXPECT_EQ(exchanges.tryFind(3, true), &request);
  EXPECT_EQ(exchanges.tryFind(3, false), nullptr) << "it has had no first reply";
  EXPECT_EQ(exchanges.tryFind(4, true), nullptr);
  request.fate = Fate::expired;
  EXPECT_EQ(exchanges.tryFind(3, true), nullptr) << "it has ended";
  exchanges.remove(request);
  EXPECT_EQ(exchanges.tryFind(3, false), nullptr);
}

TEST(ExchangesTest, TellsARequestFromAnEarlierSubscriptionWithTheSameId) {
  Exchanges exchanges;
  Exchange subscription;
  subscription.id = 3;
  subscription.hasReply = true;
  Exchange request;
  request.id = 3;
  exchanges.add(subscription);
  exchanges.add(request);

  EXPECT_EQ(exchanges.tryFind(3, true), &request);
  EXPECT_EQ(exchanges.tryFind(3, false), &subscription);
  exchanges.remove(request);
  EXPECT_EQ(exchanges.tryFind(3, false), &subscription);
}

}  // namespace
}  // namespace mpf::test
