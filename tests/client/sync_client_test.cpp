// SPDX-License-Identifier: MIT
#include <mpf/sync_client.h>

#include <gtest/gtest.h>
#include <thread>

#include <mpf/message_server.h>

#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

TEST(SyncClientTest, ReturnsMessagesThatHaveArrivedWithoutWaiting) {
  const TestBackplane backplane;
  MessageServer server(backplane, "device");
  Message held;
  server.on<Int32>([&](Int32Message&& request) {
    static_cast<void>(server.reply(server.allocReplyMessage<Int32>(request)));
    held = std::move(request);
  });
  std::thread thread([&] { server.run(); });
  SyncClient client(backplane, "device");
  ASSERT_TRUE(client.call(Int32Message(), 60s));
  server.interrupt();
  thread.join();
  EXPECT_FALSE(client.receive(0s));

  ASSERT_EQ(server.reply(server.allocReplyMessage<Int32>(held)), ReplyResult::sent);

  EXPECT_TRUE(client.receive(0s));
  EXPECT_FALSE(client.receive(0s));
}

TEST(SyncClientTest, ReportsWhyThereIsNoReply) {
  const Watchdog watchdog("sync client");
  const TestBackplane backplane;
  SyncClient client(backplane, "echo");
  auto none = client.call(Int32Message(), 1ms);
  EXPECT_EQ(none.refusal(), SendResult::notConnected);

  MessageServer server(backplane, "echo");
  Message held;
  server.on<Int32>([&](Int32Message&& request) { held = std::move(request); });
  std::thread serving([&] { server.run(); });
  ASSERT_TRUE(client.connectWait(60s));
  // `expired` when the server had no processor in that time.
  auto patience = 50ms;
  auto unknown = client.call(Int32Message(), patience);
  for (; unknown.fate() == Fate::expired; unknown = client.call(Int32Message(), patience))
    patience *= 2;
  server.interrupt();
  serving.join();
  auto expired = client.call(Int32Message(), 5ms);

  EXPECT_EQ(unknown.fate(), Fate::outcomeUnknown);
  EXPECT_EQ(expired.fate(), Fate::expired);
  EXPECT_EQ(expired.why(), "no reply: expired");
}

}  // namespace
}  // namespace mpf::test
