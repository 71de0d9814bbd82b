// SPDX-License-Identifier: MIT
// A dispatcher that its owner may poll.
#include "client/relay_dispatcher.h"

#include <poll.h>
#include <unistd.h>

#include <array>
#include <gtest/gtest.h>
#include <vector>

#include <mpf/message_client.h>
#include <mpf/message_server.h>

#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

class RelayDispatcherTest : public testing::Test {
 protected:
  RelayDispatcherTest() {
    client_.bind("echo");
    while (!client_.isConnected()) runAll();
  }
  void runAll() {
    while (!dispatcher_.runPending()) {
    }
    serve();
  }
  void serve() {
    while (auto request = server_.receive())
      EXPECT_EQ(server_.reply(std::move(request)), ReplyResult::sent);
  }
  // Sends a request and its reply; the client does not look.
  void ask() {
    ASSERT_EQ(client_.send(Int32Message({.value = 3})), SendResult::sent);
    serve();
  }
  [[nodiscard]] bool isReadable() const {
    pollfd poll{fd_, POLLIN, 0};
    return ::poll(&poll, 1, 0) == 1;
  }

  const Watchdog watchdog_{"a dispatcher"};
  const TestBackplane backplane_;
  MessageServer server_{backplane_, "echo"};
  RelayDispatcher dispatcher_{backplane_};
  const int fd_ = dispatcher_.descriptor();
  int replies_ = 0;
  MessageClient client_{dispatcher_, [this](Message&& message) {
                          if (message.getType() == MessageType::int32) ++replies_;
                        }};
};

TEST_F(RelayDispatcherTest, NeedsNoWakeUpWhileItIsPolled) {
  dispatcher_.setPolled(true);
  EXPECT_TRUE(dispatcher_.runPending());
  // What made it readable before it was polled.
  std::array<char, 64> bytes{};
  while (::read(fd_, bytes.data(), bytes.size()) > 0) {
  }

  ask();

  EXPECT_FALSE(isReadable());
  EXPECT_TRUE(dispatcher_.runPending());
  EXPECT_EQ(replies_, 1);
}

TEST_F(RelayDispatcherTest, IsWokenAgainAfterwards) {
  dispatcher_.setPolled(true);
  EXPECT_TRUE(dispatcher_.runPending());
  ask();
  dispatcher_.setPolled(false);

  EXPECT_TRUE(dispatcher_.runPending());
  EXPECT_EQ(replies_, 1) << "it arrived while nobody was woken";
  ask();

  EXPECT_TRUE(isReadable());
  EXPECT_TRUE(dispatcher_.runPending());
  EXPECT_EQ(replies_, 2);
}

}  // namespace
}  // namespace mpf::test
