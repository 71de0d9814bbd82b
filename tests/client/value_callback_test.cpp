// SPDX-License-Identifier: MIT
// MessageClient::onValues(): what its callback may do.
#include <algorithm>
#include <memory>

#include "tests/client/value_runs_fixture.h"

namespace mpf::test {
namespace {

TEST_F(ValueRuns, AreDeliveredEvenIfTheCallbackThrows) {
  startServer();
  const auto request = heldRequest();
  ASSERT_EQ(server_->replyMany<Int32>(request, readings(8)).count, 8u);
  mustThrow_ = true;
  EXPECT_THROW(receive(8), std::runtime_error);
  mustThrow_ = false;

  ASSERT_EQ(server_->replyMany<Int32>(request, readings(8, 8)).count, 8u);
  receive(16);

  expectNumbered();
}

TEST_F(ValueRuns, MayArriveWhileTheirCallbackRunsTheDispatcher) {
  startServer({.queueSize = 256});
  const auto request = heldRequest();
  int depth = 0, deepest = 0;
  onCall_ = [&](std::span<const Int32> values, const Message&) {
    const std::vector<Int32> before(values.begin(), values.end());
    deepest = std::max(deepest, ++depth);
    if (depth < 4) dispatcher_.runOnce();
    --depth;
    for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(values[i].value, before[i].value);
  };

  ASSERT_EQ(server_->replyMany<Int32>(request, readings(100)).count, 100u);
  receive(100);

  EXPECT_EQ(deepest, 4);
  expectNumbered();
}

TEST_F(ValueRuns, MayBeAnsweredWithRequests) {
  startServer();
  std::vector<Message> requests;
  requests.push_back(heldRequest());
  server_->on<Int32>([&](Int32Message&& more) { requests.push_back(std::move(more)); });
  onCall_ = [&](std::span<const Int32>, const Message&) {
    if (requests.size() == 3) return;
    EXPECT_EQ(client_.send(Int32Message()), SendResult::sent);
  };

  std::int32_t next = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    runUntil([&] { return requests.size() > i; });
    ASSERT_EQ(server_->replyMany<Int32>(requests[i], readings(3, next)).count, 3u);
    next += 3;
    receive(3 * (i + 1));
  }

  expectNumbered();
}

TEST_F(ValueRuns, MayDestroyTheirClient) {
  startServer();
  std::vector<std::int32_t> values;
  auto other = std::make_unique<MessageClient>(dispatcher_, [](const Message&) {});
  other->onValues<Int32>([&](std::span<const Int32> run, const Message&) {
    other.reset();
    for (const auto& each : run) values.push_back(each.value);
  });
  Message request;
  server_->on<Int32>([&](Int32Message&& one) { request = std::move(one); });
  other->bind("device[0]/a");
  runUntil([&] { return other->isConnected(); });
  ASSERT_EQ(other->send(Int32Message()), SendResult::sent);
  runUntil([&] { return static_cast<bool>(request); });

  ASSERT_EQ(server_->replyMany<Int32>(request, readings(30)).count, 30u);
  runUntil([&] { return !values.empty(); });

  EXPECT_EQ(other, nullptr);
  EXPECT_LT(values.size(), 30u);
}

TEST_F(ValueRuns, NeedTheirCallbackOnceAndBeforeBind) {
  const auto ignore = [](const auto&, const Message&) {};
  EXPECT_THROW(client_.onValues<Float64>(ignore), std::logic_error) << "there is one for Int32";

  MessageClient other(dispatcher_, [](const Message&) {});
  other.bind("device[0]/a");
  EXPECT_THROW(other.onValues<Int32>(ignore), std::logic_error);
}

TEST_F(ValueRuns, NeedACallbackThatIsNotEmpty) {
  MessageClient other(dispatcher_, [](const Message&) {});
  EXPECT_THROW(other.onValues<Int32>({}), std::invalid_argument);
  other.onValues<Int32>([](std::span<const Int32>, const Message&) {});  // still possible
}

}  // namespace
}  // namespace mpf::test
