// SPDX-License-Identifier: MIT
// ServerCore: which requests it returns, handles together, or ends itself.
#include "server/server_core.h"

#include <poll.h>

#include <chrono>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "shm/handling.h"
#include "tests/shm/endpoint_pair.h"
#include "tests/shm/shm_fixture.h"

namespace mpf::test {
namespace {

class ServerCoreTest : public ShmTest {
 protected:
  ServerCoreTest() {
    link_->peer()->knock(link_->header().incarnation);
    EXPECT_FALSE(server_->receive());
    EXPECT_EQ(link_->peerState(), layout::LinkState::open);
    link_->usePeerIndexOfServer();
  }
  Link* createLink() {
    auto& endpoint = client_->endpoint;
    const auto index = endpoint.tryReserve().value();
    auto server = endpoint.peers().tryOpen(serverName(), layout::SegmentKind::serverWindow);
    return &client_->keep(index, Link::create(name(), endpoint.window(), index, std::move(server)));
  }
  void sendRequest(std::uint32_t requestId, std::int64_t deadlineNs = 0,
                   std::size_t bytes = sizeof(Int32), std::uint32_t sentTick = 0) {
    Envelope envelope{.type = static_cast<std::uint16_t>(MessageType::int32),
                      .requestId = requestId,
                      .sentTick = sentTick,
                      .timeNs = deadlineNs};
    ASSERT_EQ(link_->trySend(envelope, std::vector<std::byte>(bytes), {}), LinkSend::sent);
  }
  [[nodiscard]] bool isConnected() const { return link_->peerState() == layout::LinkState::open; }
  void TearDown() override {
    server_.reset();
    client_.reset();
    ShmTest::TearDown();
  }

  std::optional<ServerCore> server_{std::in_place, backplane_, "server", ServerOptions{}};
  std::optional<End> client_{std::in_place, backplane_, ""};
  Link* link_ = createLink();
};

// Ids that differ only in bits above those of the first, small table of unanswered requests.
TEST_F(ServerCoreTest, AcceptsRequestsWhoseIdsDifferInAnyBitOfTheLargestNumberOfRequests) {
  std::vector<Message> held;
  for (const std::uint32_t id : {1u, 17u, 2u, 33u, 18u, 129u}) {
    sendRequest(id);
    held.push_back(server_->receive());
    ASSERT_TRUE(held.back()) << id;
  }

  for (auto& request : held) EXPECT_EQ(server_->replies().send(request), ReplyResult::sent);
  sendRequest(1 + 256);
  held.front() = server_->receive();
  ASSERT_TRUE(held.front());
  sendRequest(1);

  EXPECT_FALSE(server_->receive());
  EXPECT_FALSE(isConnected()) << "both requests have the same place in the largest table";
}

TEST_F(ServerCoreTest, ReturnsEachRequestOnce) {
  sendRequest(1);
  sendRequest(2);

  const auto first = server_->receive();
  const auto second = server_->receive();

  EXPECT_EQ(first.route().requestId, 1u);
  EXPECT_EQ(second.route().requestId, 2u);
  EXPECT_FALSE(server_->receive());
  EXPECT_EQ(server_->counts().requests, 2u);
}

TEST_F(ServerCoreTest, ARequestWhoseDeadlineHasPassedIsNotReturned) {
  sendRequest(1, 1);
  sendRequest(2, INT64_MAX);

  const auto request = server_->receive();

  EXPECT_EQ(request.route().requestId, 2u);
  ASSERT_TRUE(link_->incoming().hasMessage());
  EXPECT_EQ(link_->incoming().begin().type, static_cast<std::uint16_t>(MessageType::requestFate));
  link_->incoming().end();
}

TEST_F(ServerCoreTest, AnIdThatIsInUseEndsTheConnection) {
  sendRequest(1);
  const auto request = server_->receive();
  sendRequest(1);

  EXPECT_FALSE(server_->receive());

  EXPECT_FALSE(isConnected());
}

TEST_F(ServerCoreTest, ARequestWithoutAnIdEndsTheConnection) {
  sendRequest(0);

  EXPECT_FALSE(server_->receive());

  EXPECT_FALSE(isConnected());
}

TEST_F(ServerCoreTest, AnInterruptEndsOneWait) {
  server_->interrupt();
  EXPECT_TRUE(server_->isInterrupted());

  EXPECT_FALSE(server_->wait(Deadline::never()));
  EXPECT_FALSE(server_->isInterrupted());
  sendRequest(1);

  EXPECT_TRUE(server_->wait(Deadline::never()));
  EXPECT_TRUE(server_->receive());
}

TEST_F(ServerCoreTest, AnInterruptEndsAWaitInAHandlerAndTheOneOfItsCaller) {
  server_->callHandler([&] {
    server_->interrupt();
    EXPECT_FALSE(server_->wait(Deadline::never()));
    EXPECT_FALSE(server_->wait(Deadline::never()));
  });

  EXPECT_TRUE(server_->isInterrupted());
  EXPECT_FALSE(server_->wait(Deadline::never()));
  EXPECT_FALSE(server_->isInterrupted());
}

TEST_F(ServerCoreTest, OneThreadAtATimeRunsAServer) {
  std::optional<ServerCore::Run> run(std::in_place, *server_);
  const ServerCore::Run inAHandler(*server_);
  const auto whyOfAnother = [&] {
    std::string why;
    std::thread([&] {
      why = whatOf<std::logic_error>([&] { const ServerCore::Run another(*server_); });
    }).join();
    return why;
  };

  EXPECT_THAT(whyOfAnother(), testing::HasSubstr("\"server\""));
  run.reset();

  EXPECT_EQ(whyOfAnother(), "");
}

TEST_F(ServerCoreTest, NotesTheTimeOfTheFirstRequestAfterASleep) {
  const auto& control = link_->peer()->control();
  sendRequest(1);
  ASSERT_TRUE(server_->receive());
  ASSERT_EQ(control.progressAtNs.load(), 0u) << "the request has no time stamp";

  while (control.wakes.load() == 0)
    ASSERT_FALSE(server_->wait(Deadline::after(std::chrono::milliseconds(1))));
  sendRequest(2);
  ASSERT_TRUE(server_->receive());

  EXPECT_NE(control.progressAtNs.load(), 0u);
}

TEST_F(ServerCoreTest, NotesTheTimeOfTheFirstRequestAfterItsDescriptorWasArmed) {
  server_->descriptor();
  ASSERT_FALSE(server_->receive());
  sendRequest(1);
  ASSERT_TRUE(server_->receive());

  EXPECT_NE(link_->peer()->control().progressAtNs.load(), 0u);
}

TEST_F(ServerCoreTest, AQueueSizeOutsideTheLimitsIsAnError) {
  EXPECT_THROW(server_->setQueueSize(0), std::invalid_argument);
  EXPECT_THROW(server_->setQueueSize(16385), std::invalid_argument);

  server_->setQueueSize(16384);

  EXPECT_EQ(server_->counts().queueSize, 16384u);
}

class RequestRunTest : public ServerCoreTest {
 protected:
  RequestRunTest() {
    server_->handlers().set(MessageType::int32, {}, [this](std::span<std::byte> values) {
      sizes_.push_back(values.size() / sizeof(Int32));
      const auto handling = Handling::of(control().handling.load());
      EXPECT_TRUE(handling && handling->type == static_cast<std::uint16_t>(MessageType::int32));
    });
  }
  [[nodiscard]] const layout::WindowControl& control() const { return link_->peer()->control(); }
  // Handles the next requests; false if they were received as a message, or none waits.
  bool handleRun() {
    bool hasHandledRun = false;
    EXPECT_FALSE(server_->receiveOrHandleRun(hasHandledRun));
    server_->endHandling();
    return hasHandledRun;
  }
  [[nodiscard]] static std::uint64_t total(const layout::Histogram& histogram) {
    std::uint64_t sum = 0;
    for (const auto& bucket : histogram.buckets) sum += bucket.load(std::memory_order_relaxed);
    return sum;
  }
  // The ids of the replies that wait, which are first replies.
  std::vector<std::uint32_t> repliedIds() {
    std::vector<std::uint32_t> ids;
    for (auto& ring = link_->incoming(); ring.hasMessage(); ring.end()) {
      const auto envelope = ring.begin();
      EXPECT_EQ(envelope.flags, layout::kSlotFirstReply);
      EXPECT_EQ(envelope.type, static_cast<std::uint16_t>(MessageType::int32));
      ids.push_back(envelope.requestId);
    }
    return ids;
  }

  std::vector<std::size_t> sizes_;
};

TEST_F(RequestRunTest, IsAnsweredUnderTheIdOfEachRequest) {
  for (const std::uint32_t id : {7u, 3u, 5u}) sendRequest(id);

  EXPECT_TRUE(handleRun());

  EXPECT_THAT(sizes_, testing::ElementsAre(3));
  EXPECT_THAT(repliedIds(), testing::ElementsAre(7, 3, 5));
  EXPECT_EQ(server_->counts().requests, 3u);
  EXPECT_EQ(server_->counts().replies, 3u);
  EXPECT_EQ(control().handling.load(), 0u);
}

TEST_F(RequestRunTest, NeedsTwoRequests) {
  sendRequest(1);

  bool hasHandledRun = false;
  const auto request = server_->receiveOrHandleRun(hasHandledRun);

  EXPECT_TRUE(request);
  EXPECT_FALSE(hasHandledRun);
  EXPECT_THAT(sizes_, testing::IsEmpty());
}

TEST_F(RequestRunTest, EndsTheConnectionIfAnIdIsInUse) {
  sendRequest(1);
  const auto request = server_->receive();
  sendRequest(2);
  sendRequest(1);

  EXPECT_TRUE(handleRun());

  EXPECT_FALSE(isConnected());
  EXPECT_EQ(control().protocolErrors.load(), 1u);
  EXPECT_THAT(sizes_, testing::IsEmpty());
}

TEST_F(RequestRunTest, EndsTheConnectionIfTwoRequestsHaveTheSameId) {
  sendRequest(1);
  sendRequest(1);

  EXPECT_TRUE(handleRun());

  EXPECT_FALSE(isConnected());
  EXPECT_THAT(sizes_, testing::IsEmpty());
}

TEST_F(RequestRunTest, LetsTheIdsBeUsedAgain) {
  for (int round = 0; round < 3; ++round) {
    sendRequest(1);
    sendRequest(2);
    EXPECT_TRUE(handleRun());
  }

  EXPECT_TRUE(isConnected());
  EXPECT_THAT(repliedIds(), testing::ElementsAre(1, 2, 1, 2, 1, 2));
}

TEST_F(RequestRunTest, TimesTheFirstRequestThatSaysWhenItWasSent) {
  sendRequest(1);
  sendRequest(2, 0, sizeof(Int32), Tick::of(Clock::nowNs()));
  sendRequest(3, 0, sizeof(Int32), Tick::of(Clock::nowNs()));

  EXPECT_TRUE(handleRun());

  EXPECT_EQ(total(control().queueWaitNs), 1u);
  EXPECT_EQ(total(control().serviceNs), 1u);
}

TEST_F(RequestRunTest, DoesNotContainABodyOfAnotherSize) {
  sendRequest(1);
  sendRequest(2, 0, sizeof(Int32) - 1);
  sendRequest(3);

  bool hasHandledRun = false;
  EXPECT_FALSE(server_->receiveOrHandleRun(hasHandledRun));
  EXPECT_TRUE(hasHandledRun);
  EXPECT_THAT(sizes_, testing::ElementsAre(1));
  const auto invalid = server_->receiveOrHandleRun(hasHandledRun);
  EXPECT_FALSE(invalid.isSound());
}

TEST_F(RequestRunTest, KeepsTheRequestsAfterAHandlerThatThrows) {
  server_->handlers().set(MessageType::int32, {},
                          [](auto) { throw std::runtime_error("the handler throws"); });
  pollfd descriptor{server_->descriptor(), POLLIN, 0};
  ASSERT_FALSE(server_->receive());
  sendRequest(1);
  sendRequest(2);
  bool hasHandledRun = false;

  EXPECT_THROW(server_->receiveOrHandleRun(hasHandledRun), std::runtime_error);

  EXPECT_EQ(::poll(&descriptor, 1, 0), 1);
  EXPECT_EQ(control().handling.load(), 0u);
  EXPECT_EQ(control().refused.load(), 2u);
}

}  // namespace
}  // namespace mpf::test
