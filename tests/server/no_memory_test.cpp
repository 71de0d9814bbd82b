// SPDX-License-Identifier: MIT
// A server whose process has no memory: it throws std::bad_alloc, or continues without it.
#include <signal.h>

#include <algorithm>
#include <gtest/gtest.h>
#include <memory>
#include <new>
#include <optional>
#include <vector>

#include <mpf/message_server.h>
#include <mpf/sync_client.h>

#include "tests/shm/child.h"
#include "tests/support/limited_memory.h"
#include "tests/support/needs_a_child.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

constexpr const char* kName = "a server whose name needs an allocation";
constexpr int kMost = 12;  // more allocations than the functions below make

class NoMemoryTest : public testing::Test {
 protected:
  // A server, and a request of a client that was killed.
  struct Bereaved {
    std::unique_ptr<MessageServer> server;
    Message request;
  };
  Bereaved serverOfAKilledClient() {
    Bereaved made{std::make_unique<MessageServer>(backplane_, kName), {}};
    Child client([&](Child::Self& self) {
      MessageClient sender(Backplane::named(backplane_.name()), [](const Message&) {});
      sender.bind(kName);
      self.ready();
      EXPECT_TRUE(sender.connectWait(60s));
      EXPECT_EQ(sender.send(Int32Message()), SendResult::sent);
      self.stay();
    });
    client.go();
    while (!(made.request = made.server->receive())) made.server->waitForMessage();
    client.end(SIGKILL);
    return made;
  }

  Watchdog watchdog_{"no memory test"};
  TestBackplane backplane_;
};

TEST_F(NoMemoryTest, TheConstructorThrows) {
  std::unique_ptr<MessageServer> server;
  int allocations = 0;

  for (; server == nullptr; ++allocations) {
    try {
      const LimitedMemory limited(allocations);
      server = std::make_unique<MessageServer>(backplane_, kName);
    } catch (const std::bad_alloc&) {  // NOLINT(bugprone-empty-catch): the loop repeats it
    }
  }

  EXPECT_GT(allocations, 2);
  EXPECT_EQ(server->getName(), kName);
}

TEST_F(NoMemoryTest, TheDeathOfAClientEndsItsConnection) {
  MPF_NEEDS_A_CHILD;
  for (int allocations = 0; allocations < kMost; ++allocations) {
    auto [server, request] = serverOfAKilledClient();

    while (server->clientOf(request) != 0) {
      server->waitForMessage();
      try {
        const LimitedMemory limited(allocations);
        EXPECT_FALSE(server->receive());
      } catch (const std::bad_alloc&) {  // NOLINT(bugprone-empty-catch): the loop repeats it
      }
    }

    EXPECT_EQ(server->reply(std::move(request)), ReplyResult::clientGone);
    static_cast<void>(backplane_.removeDead());
  }
}

TEST_F(NoMemoryTest, AServerEndsAfterTheDeathOfAClient) {
  MPF_NEEDS_A_CHILD;
  for (int allocations = 0; allocations < kMost; ++allocations) {
    auto [server, request] = serverOfAKilledClient();

    {
      const LimitedMemory limited(allocations);
      server.reset();
    }

    static_cast<void>(backplane_.removeDead());
  }
}

// The client has a reply in the server's pool, and has not received it.
TEST_F(NoMemoryTest, AServerEndsBesideALivingClient) {
  auto server = std::make_unique<MessageServer>(backplane_, kName);
  std::size_t length = 0;
  Dispatcher dispatcher(backplane_);
  MessageClient client(dispatcher, [&](const Message& message) {
    length = std::max<std::size_t>(length, message.arrayLength());
  });
  client.bind(kName);
  while (!client.isConnected()) {
    server->handleOne();
    dispatcher.runOnce(Deadline::after(1ms));
  }
  ASSERT_EQ(client.send(Int32Message()), SendResult::sent);
  Message request;
  while (!(request = server->receive())) server->waitForMessage();
  ASSERT_EQ(server->reply(server->allocReplyMessage<Float64Array>(request, 10'000)),
            ReplyResult::sent);
  {
    const LimitedMemory limited(0);
    server.reset();
  }

  while (length == 0) dispatcher.runOnce();

  EXPECT_EQ(length, 10'000u);
}

}  // namespace
}  // namespace mpf::test
