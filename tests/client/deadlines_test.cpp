// SPDX-License-Identifier: MIT
// Requests whose deadline has passed when they are sent, beside a full queue: a request may be
// refused while the dispatcher's thread looks for expired ones.
#include <atomic>
#include <gtest/gtest.h>
#include <thread>
#include <vector>

#include <mpf/message_client.h>
#include <mpf/message_server.h>

#include "tests/client/client_fixture.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

TEST(Deadlines, EachAcceptedRequestEndsOnceBesideAFullQueue) {
  constexpr std::int32_t kRequests = 200'000;
  const Watchdog watchdog("deadlines");
  const TestBackplane backplane;
  MessageServer server(backplane, "busy", {.queueSize = 4});
  server.on<Int32>([](Int32&) { std::this_thread::yield(); });
  std::thread serving([&] { server.run(); });
  std::vector<std::atomic<int>> ends(kRequests);
  std::atomic<int> ended{0};
  std::atomic<int> unknown{0};  // fates of no request
  MessageClient client(backplane, [&](const Message& message) {
    if (message.getType() == MessageType::connect) return;
    const auto* const fate = message.tryAs<RequestFate>();
    if (fate != nullptr && fate->requestId == 0) ++unknown;
    else ++ends[static_cast<std::size_t>(message.getClientExtra())];
    ++ended;
  });
  client.bind("busy");
  ASSERT_TRUE(client.connectWait(60s));

  std::vector<std::size_t> accepted;
  for (std::int32_t i = 0; i < kRequests; ++i) {
    Int32Message request;
    request.setClientExtra(i);
    const auto deadline = i % 50 == 0 ? Deadline::never() : Deadline::after(-5ms);
    if (client.send(std::move(request), deadline) == SendResult::sent)
      accepted.push_back(static_cast<std::size_t>(i));
  }
  while (static_cast<std::size_t>(ended.load()) < accepted.size()) std::this_thread::yield();
  server.interrupt();
  serving.join();

  EXPECT_EQ(unknown.load(), 0);
  for (const auto each : accepted) EXPECT_EQ(ends[each].load(), 1) << each;
}

}  // namespace
}  // namespace mpf::test
