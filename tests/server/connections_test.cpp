// SPDX-License-Identifier: MIT
// Connections: clients that connect, disconnect and die, and the numbers of clients and requests.
#include "server/connections.h"

#include <signal.h>
#include <sys/prctl.h>

#include <atomic>
#include <bit>
#include <gmock/gmock.h>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/base/child_process.h"
#include "tests/server/server_parts_fixture.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::Pair;

class ConnectionsTest : public ServerPartsTest {
 protected:
  ConnectionsTest() {
    connections_.onClient([this](std::uint64_t client, bool isConnected) {
      reports_.emplace_back(client, isConnected);
    });
  }
  std::vector<std::pair<std::uint64_t, bool>> reports_;
};

TEST_F(ConnectionsTest, AnOpenConnectionIsReportedAndFound) {
  auto& link = createLink();

  const auto& connection = accept(link);

  EXPECT_THAT(reports_, ElementsAre(Pair(connection.client(), true)));
  EXPECT_TRUE(connections_.contains(link.header().incarnation));
  EXPECT_EQ(valueOf(control().linksOpened), 1u);
}

TEST_F(ConnectionsTest, AClosedConnectionIsReportedAndForgotten) {
  auto& link = createLink();
  auto& connection = accept(link);
  const auto client = connection.client();
  const auto route = noteRequest(connection, 3);

  connections_.close(connection);

  EXPECT_EQ(link.peerState(), layout::LinkState::closed);
  EXPECT_THAT(reports_, ElementsAre(Pair(client, true), Pair(client, false)));
  EXPECT_FALSE(connections_.contains(link.header().incarnation));
  EXPECT_EQ(Connections::clientOf(route), 0u);
  EXPECT_FALSE(connections_.isUnanswered(client, 3));
  EXPECT_EQ(valueOf(control().linksClosed), 1u);
}

TEST_F(ConnectionsTest, ARouteNamesOneClientAlthoughItsConnectionIsReused) {
  auto& former = accept(createLink());
  const auto formerRoute = former.routeOf(1, nullptr);
  connections_.close(former);

  auto& present = accept(createLink());
  const auto route = present.routeOf(1, nullptr);

  ASSERT_EQ(&present, &former) << "the test needs the same object";
  EXPECT_EQ(Connections::clientOf(formerRoute), 0u);
  EXPECT_EQ(Connections::clientOf(route), present.client());
}

TEST_F(ConnectionsTest, ARequestWithoutReplyIsUnansweredForItsClient) {
  auto& connection = accept(createLink());
  const auto client = connection.client();
  noteRequest(connection, 3);
  noteRequest(connection, 5);

  EXPECT_TRUE(connections_.isUnanswered(client, 3));
  EXPECT_FALSE(connections_.isUnanswered(client, 4));
  EXPECT_FALSE(connections_.isUnanswered(client + (std::uint64_t{1} << 32), 3)) << "another client";
  EXPECT_THAT(connections_.unanswered(client), testing::UnorderedElementsAre(3u, 5u));
  EXPECT_EQ(connections_.routeTo(0, 3).link, 0u) << "no client has the number 0";
}

TEST_F(ConnectionsTest, AConnectionEndsAfterTheLastRequestOfAClientThatClosedIt) {
  auto& link = createLink();
  auto& connection = accept(link);
  const auto route = connection.routeOf(1, nullptr);
  ASSERT_EQ(send(link, 1), LinkSend::sent);
  EXPECT_TRUE(Connections::isConnected(route));
  link.setState(layout::LinkState::closed);
  EXPECT_FALSE(Connections::isConnected(route));

  connections_.closeIfClientClosed(connection);
  ASSERT_TRUE(connection.channel) << "a request waits";
  auto& incoming = connection.channel->link().incoming();
  static_cast<void>(incoming.begin());
  incoming.end();
  connections_.closeIfClientClosed(connection);

  EXPECT_FALSE(connection.channel);
  EXPECT_EQ(valueOf(control().protocolErrors), 0u);
}

TEST_F(ConnectionsTest, ExceptionsOfTheCallbackAreThrownLaterInTheirOrder) {
  connections_.onClient([](std::uint64_t, bool isConnected) {
    throw std::runtime_error(isConnected ? "on" : "off");
  });
  const auto textOf = [this] {
    return whatOf<std::runtime_error>([this] { connections_.throwNext(); });
  };

  auto& connection = accept(createLink());
  connections_.close(connection);

  ASSERT_TRUE(connections_.hasThrown());
  EXPECT_EQ(textOf(), "on");
  EXPECT_EQ(textOf(), "off");
  EXPECT_FALSE(connections_.hasThrown());
}

TEST_F(ConnectionsTest, ARequestIsNotThatOfTheSameIdAfterTheClientHasUsedAllIds) {
  auto& connection = accept(createLink());
  const auto client = connection.client();
  const auto answered = noteRequest(connection, 5);
  connection.noteFirstReply(5, counts_);
  const auto waiting = noteRequest(connection, 0xFFFFFFFF);

  const auto present = noteRequest(connection, 5);

  EXPECT_TRUE(connection.isUnanswered(present));
  EXPECT_TRUE(connection.isUnanswered(waiting));
  EXPECT_FALSE(connection.isUnanswered(answered)) << "has the id of another request";
  EXPECT_TRUE(Connections::isConnected(answered));
  EXPECT_EQ(Connections::clientOf(present), client);
  EXPECT_TRUE(connection.isUnanswered(connections_.routeTo(client, 5)));
  EXPECT_TRUE(connection.isUnanswered(connections_.routeTo(client, 0xFFFFFFFF)));
  EXPECT_EQ(connections_.routeTo(client, 6).flags, present.flags);
}

TEST_F(ConnectionsTest, IdsInAnotherOrderAreNoNewCount) {
  auto& connection = accept(createLink());
  const auto first = noteRequest(connection, 0x80000001);
  connection.noteFirstReply(first.requestId, counts_);

  for (const auto id : {2u, 1u, 0x80000000u, 0x7FFFFFFFu}) noteRequest(connection, id);

  EXPECT_EQ(connection.routeOf(1, nullptr).flags, first.flags);
}

TEST_F(ConnectionsTest, AnExceptionOfTheCallbackEndsTheNextWait) {
  auto& connection = accept(createLink());
  connections_.onClient([](std::uint64_t, bool) { throw std::runtime_error("off"); });
  static_cast<void>(server_->endpoint.takeLocalEvent());

  connections_.close(connection);

  EXPECT_TRUE(server_->endpoint.hasControlEvents());
}

// The client has the reply already, and uses the place for its next request.
TEST_F(ConnectionsTest, ARequestWaitsForTheReplyThatMakesItsPlaceFree) {
  auto& link = createLink();
  auto& connection = accept(link);
  const auto places = std::bit_ceil(link.header().maxOutstanding);
  ASSERT_TRUE(connection.tryNoteRequest(1));
  while (connection.unanswered.size() != places)
    ASSERT_TRUE(
        connection.tryNoteRequest(1 + static_cast<std::uint32_t>(connection.unanswered.size())));
  std::atomic<bool> isReplying{false};
  std::atomic<bool> isNext{false};
  std::thread replying([&] {
    const BiasedLock::Guard guard(*connection.lock);
    isReplying = true;
    while (!isNext) std::this_thread::yield();
    for (int i = 0; i < 1000; ++i) std::this_thread::yield();
    connection.placeOf(1).store(0, std::memory_order_relaxed);
  });
  while (!isReplying) std::this_thread::yield();

  isNext = true;
  const bool isNoted = connection.tryNoteRequest(1 + places);

  replying.join();
  EXPECT_TRUE(isNoted);
  EXPECT_TRUE(connection.isUnanswered(1 + places));
  EXPECT_FALSE(connection.tryNoteRequest(1)) << "not free now";
}

TEST_F(ConnectionsTest, WaitsForNoLockInTheChildOfAFork) {
  auto& connection = accept(createLink());
  const auto client = connection.client();
  const auto route = noteRequest(connection, 3);
  const BiasedLock::Guard lock(*connection.lock);  // never released in the child

  const auto status = endOf([&] {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    EXPECT_EQ(Connections::clientOf(route), 0u);
    EXPECT_FALSE(Connections::isConnected(route));
    EXPECT_FALSE(connections_.isUnanswered(client, 3));
    EXPECT_THAT(connections_.unanswered(client), testing::IsEmpty());
    return HasFailure() ? 1 : 0;
  });

  EXPECT_EQ(status, 0);
}

TEST_F(ConnectionsTest, CloseAllEndsEachConnection) {
  auto& first = createLink();
  auto& second = createLink();
  accept(first);
  accept(second);

  static_cast<void>(connections_.closeAll());

  EXPECT_EQ(first.peerState(), layout::LinkState::closed);
  EXPECT_EQ(second.peerState(), layout::LinkState::closed);
  EXPECT_EQ(control().linkCount.load(std::memory_order_relaxed), 0u);
}

}  // namespace
}  // namespace mpf::test
