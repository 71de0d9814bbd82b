// SPDX-License-Identifier: MIT
// PendingBinds: the servers that clients of a backplane wait for.
#include "router/outgoing/pending_binds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <optional>

#include <mpf/message_client.h>

#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::router::test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(PendingBinds, AreThoseOfLivingClientsAtAnyLocation) {
  const mpf::test::Watchdog watchdog("pending binds");
  const mpf::test::TestBackplane backplane;
  Dispatcher dispatcher(backplane, {});
  PendingBinds pendingBinds(backplane);
  EXPECT_THAT(pendingBinds.look(), IsEmpty());

  std::optional<MessageClient> first(std::in_place, dispatcher, [](Message&&) {});
  first->bind("echo", 1);
  MessageClient second(dispatcher, [](Message&&) {});
  second.bind("dac", 7);

  EXPECT_THAT(pendingBinds.look(), ElementsAre(ServerName{1, "echo"}, ServerName{7, "dac"}));
  EXPECT_EQ(pendingBinds.problem(), "");
  first.reset();
  EXPECT_THAT(pendingBinds.look(), ElementsAre(ServerName{7, "dac"}));
}

TEST(PendingBinds, OfSeveralClientsForOneServerAreOne) {
  const mpf::test::Watchdog watchdog("pending binds");
  const mpf::test::TestBackplane backplane;
  Dispatcher dispatcher(backplane, {});
  PendingBinds pendingBinds(backplane);
  MessageClient first(dispatcher, [](Message&&) {});
  MessageClient second(dispatcher, [](Message&&) {});

  first.bind("echo", 1);
  second.bind("echo", 1);

  EXPECT_THAT(pendingBinds.look(), ElementsAre(ServerName{1, "echo"}));
}

}  // namespace
}  // namespace mpf::router::test
