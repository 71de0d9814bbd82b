// SPDX-License-Identifier: MIT
// Link: which messages are timed.
#include "tests/shm/link_fixture.h"

namespace mpf::test {
namespace {

TEST_F(LinkTest, TimesSlowMessagesToASleepingPeerAndOneIn64ToAPollingOne) {
  const auto link = makeLink();
  const auto timedOf = [&](int messages) {
    int timed = 0;
    for (int i = 0; i < messages; ++i) {
      timed += link.client.timeOfNext() != 0 ? 1 : 0;
      EXPECT_EQ(sendBody(link.client, {}), LinkSend::sent);
      take(link.server);
    }
    return timed;
  };
  Link::execute(link.server.unwatch());

  EXPECT_EQ(timedOf(10), 10);

  link.server.watch(true);
  timedOf(54);
  EXPECT_EQ(timedOf(256), 4);

  timedOf(5);
  Link::execute(link.server.unwatch());
  EXPECT_EQ(timedOf(1), 1) << "the first message after the peer has stopped polling";
}

TEST_F(LinkTest, TimesARunInEach64MessagesToAPollingPeer) {
  const auto link = makeLink();
  link.server.watch(true);
  // Of several slots, so that no run begins at a message whose number is a multiple of 64.
  ASSERT_EQ(sendBody(link.client, filled(100)), LinkSend::sent);
  take(link.server);
  const auto bodies = filled(8 * layout::kFirstSlotBodyBytes);

  int timed = 0;
  for (int round = 0; round < 80; ++round) {
    for (std::size_t sent = 0; sent < 8;) {
      const auto words = [&](std::size_t index, std::int64_t sentNs) {
        EXPECT_TRUE(index == 0 || sentNs == 0) << "only the first message of a run is timed";
        timed += sentNs != 0 ? 1 : 0;
        return EnvelopeWords::of({.type = 1}, 1, layout::kFirstSlotBodyBytes);
      };
      const auto rest = std::span(bodies).subspan(sent * layout::kFirstSlotBodyBytes);
      const auto before = link.client.outgoing().messages();
      sent += link.client.trySendRun(words, rest, {});
      ASSERT_NE(before % 64, 0u) << "else each rule would time this run";
    }
    for (int i = 0; i < 8; ++i) take(link.server);
  }

  EXPECT_EQ(timed, 9) << "the first 64 had begun before";
}

TEST_F(LinkTest, TimesAMessageThatIsSentAtTheSecondAttempt) {
  const auto link = makeLink();
  Link::execute(link.server.unwatch());
  while (sendBody(link.client, {}) == LinkSend::sent) {
  }
  const auto first = link.client.timeOfNext();
  ASSERT_EQ(sendBody(link.client, {}), LinkSend::full);

  EXPECT_NE(first, 0);
  EXPECT_NE(link.client.timeOfNext(), 0);
}

}  // namespace
}  // namespace mpf::test
