// SPDX-License-Identifier: MIT
// RemoteConnection: the numbers of the clients of a connection.
#include "router/outgoing/remote_connection.h"

#include "router/outgoing/proxy.h"
#include "tests/router/router_parts_fixture.h"

namespace mpf::test {
namespace {

using router::Proxy;
using router::RemoteConnection;
using testing::HasSubstr;

class RemoteConnectionTest : public RouterPartsTest {
 protected:
  ~RemoteConnectionTest() noexcept override = default;

  void connect(std::uint32_t maxClients) {
    startGreeted(greeting([=](auto greeting) { greeting.setMaxClients(maxClients); }));
    connection_.emplace(*line_, record_, context_.log, "far:9900", [this] { ++removed_; });
    echo_.emplace(context_, *connection_, router::ServerName{1, "echo"}, Proxy::Offer{});
    dac_.emplace(context_, *connection_, router::ServerName{1, "dac"}, Proxy::Offer{});
  }
  void TearDown() override {
    dac_.reset();
    echo_.reset();
    connection_.reset();
    RouterPartsTest::TearDown();
  }

  int removed_ = 0;
  std::optional<RemoteConnection> connection_;
  std::optional<Proxy> echo_, dac_;
};

TEST_F(RemoteConnectionTest, NumbersAreNotUsedAgain) {
  connect(16000);
  EXPECT_EQ(connection_->tryAddClient(*echo_), 1u);
  EXPECT_EQ(connection_->tryAddClient(*dac_), 2u);
  EXPECT_EQ(connection_->proxyOf(1), &*echo_);
  EXPECT_EQ(connection_->proxyOf(2), &*dac_);
  EXPECT_EQ(record_->clients, 2u);

  connection_->removeClient(2);

  EXPECT_EQ(removed_, 1);
  EXPECT_EQ(record_->clients, 1u);
  EXPECT_EQ(connection_->proxyOf(2), nullptr);
  EXPECT_EQ(connection_->tryAddClient(*dac_), 3u);
}

TEST_F(RemoteConnectionTest, RefusesMoreClientsThanThePeerAcceptsAndLogsItOnce) {
  connect(2);
  ASSERT_TRUE(connection_->tryAddClient(*echo_));
  ASSERT_TRUE(connection_->tryAddClient(*echo_));

  EXPECT_EQ(connection_->tryAddClient(*dac_), std::nullopt);
  EXPECT_EQ(connection_->tryAddClient(*dac_), std::nullopt);
  EXPECT_EQ(logged_,
            "far:9900 accepts at most 2 clients per connection (its max-clients): further clients "
            "are refused\n");

  connection_->removeClient(1);
  EXPECT_EQ(connection_->tryAddClient(*dac_), 3u);
}

TEST_F(RemoteConnectionTest, ThePeerMayNameClientsThatHaveDisconnectedButNoOthers) {
  connect(16000);
  ASSERT_TRUE(connection_->tryAddClient(*echo_));
  ASSERT_TRUE(connection_->tryAddClient(*echo_));
  connection_->removeClient(1);

  EXPECT_EQ(connection_->openedProxyOf(1), nullptr);
  EXPECT_EQ(connection_->openedProxyOf(2), &*echo_);
  EXPECT_THROW(static_cast<void>(connection_->openedProxyOf(0)), ProtocolError);
  EXPECT_THROW(static_cast<void>(connection_->openedProxyOf(3)), ProtocolError);
}

}  // namespace
}  // namespace mpf::test
