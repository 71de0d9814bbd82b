// SPDX-License-Identifier: MIT
// The words of a link that say on which processor its consumers poll.
#include "shm/cache_line.h"
#include "tests/shm/endpoint_pair.h"
#include "tests/shm/pinned.h"
#include "tests/shm/shm_fixture.h"
#include "tests/support/wait_modes.h"

namespace mpf::test {
namespace {

class PolledOnTest : public ShmTest {
  const Pinned pinned_;
};
class PolledOnInModesTest : public PolledOnTest, public testing::WithParamInterface<WaitMode> {};
INSTANTIATE_TEST_SUITE_P(In, PolledOnInModesTest, kWaitModes, nameOfWaitMode);

TEST_P(PolledOnInModesTest, ThePeerSeesWhereAnEndpointPollsUnlessItSleepsAtOnce) {
  End server(backplane_, "server", GetParam());
  End client(backplane_, "", GetParam());
  const auto link = connect(client, server);
  ASSERT_EQ(send(link.client, 7), LinkSend::sent);

  while (server.endpoint.next()) EXPECT_EQ(End::tryTake(link.server), 7u);

  EXPECT_EQ(link.client.control().requestsPolledOn.load(std::memory_order_relaxed),
            GetParam() == WaitMode::block ? 0 : lines::thisProcessor());
}

TEST_F(PolledOnTest, EachSideLooksWhereItsPeerPolls) {
  End server(backplane_, "server", WaitMode::block);
  End client(backplane_, "", WaitMode::block);
  const auto first = connect(client, server);
  const auto second = connect(client, server);
  const auto elsewhere = lines::thisProcessor() + 1;
  first.server.control().requestsPolledOn.store(elsewhere, std::memory_order_relaxed);
  second.server.control().repliesPolledOn.store(elsewhere, std::memory_order_relaxed);

  for (auto* const link : {&first.client, &first.server, &second.client, &second.server})
    ASSERT_EQ(send(*link, 1), LinkSend::sent);

  EXPECT_TRUE(first.client.outgoing().isPolledElsewhere());
  EXPECT_FALSE(first.server.outgoing().isPolledElsewhere());
  EXPECT_FALSE(second.client.outgoing().isPolledElsewhere());
  EXPECT_TRUE(second.server.outgoing().isPolledElsewhere());
}

}  // namespace
}  // namespace mpf::test
