// SPDX-License-Identifier: MIT
// ReplyWindow: when the window is used up, and when credit is due.
#include "router/outgoing/reply_window.h"

#include <gtest/gtest.h>

namespace mpf::router::test {
namespace {

TEST(ReplyWindow, IsUsedUpByTheRepliesThatWereReceived) {
  ReplyWindow window(100);

  window.received(99);
  EXPECT_FALSE(window.isUsedUp()) << "one more reply of any size may come";
  window.received(500);

  EXPECT_TRUE(window.isUsedUp());
}

TEST(ReplyWindow, GivesCreditForAQuarterAtATime) {
  ReplyWindow window(400);
  window.received(400);

  EXPECT_EQ(window.taken(60), 0u);
  EXPECT_TRUE(window.isUsedUp());
  EXPECT_EQ(window.taken(60), 120u);
  EXPECT_FALSE(window.isUsedUp());
  EXPECT_EQ(window.taken(99), 0u) << "it begins again";
}

// A reply that is lost may be counted with more bytes than it took.
TEST(ReplyWindow, CreditBeyondWhatWasReceivedDoesNotEnlargeIt) {
  ReplyWindow window(400);
  window.received(100);

  EXPECT_EQ(window.taken(1000), 1000u);
  EXPECT_FALSE(window.isUsedUp());
  window.received(400);

  EXPECT_TRUE(window.isUsedUp());
}

}  // namespace
}  // namespace mpf::router::test
