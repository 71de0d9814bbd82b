// SPDX-License-Identifier: MIT
// FarClients: the numbers of the clients of a connection, and its limit.
#include "router/incoming/far_clients.h"

#include "tests/router/router_parts_fixture.h"

namespace mpf::test {
namespace {

using router::FarClient;
using router::FarClients;

class FarClientsTest : public RouterPartsTest {
 protected:
  ~FarClientsTest() noexcept override = default;

  void SetUp() override {
    limits_.maxClients = 3;
    startGreeted();
    clients_.emplace(context_, *line_, record_,
                     FarClient::Events{.onConnected = [](FarClient&) {},
                                       .onDisconnected = [](FarClient&) {},
                                       .onRefused = [](FarClient&, const std::string&) {}});
  }
  void TearDown() override {
    clients_.reset();
    RouterPartsTest::TearDown();
  }
  // Opens a client of a server that is not running.
  void add(std::uint32_t number, std::uint32_t binding) {
    clients_->open(number);
    clients_->add({.number = number, .binding = binding, .queueSize = 4, .window = 4096},
                  {0, "echo"});
  }
  // The farewell that open(number) causes; nullopt: none.
  std::optional<FarewellCode> refusalOf(std::uint32_t number) {
    try {
      clients_->open(number);
      return std::nullopt;
    } catch (const ProtocolError& error) {
      return error.code();
    }
  }

  std::optional<FarClients> clients_;
};

TEST_F(FarClientsTest, NumbersIncreaseAndAreNotUsedAgain) {
  EXPECT_EQ(refusalOf(0), FarewellCode::PROTOCOL);
  EXPECT_EQ(refusalOf(3), std::nullopt);
  EXPECT_EQ(refusalOf(3), FarewellCode::PROTOCOL);
  EXPECT_EQ(refusalOf(2), FarewellCode::PROTOCOL);
  EXPECT_EQ(refusalOf(4), std::nullopt);
}

TEST_F(FarClientsTest, AClientThatWasNeverOpenedIsAProtocolError) {
  clients_->open(1);

  EXPECT_EQ(clients_->find(1), nullptr) << "opened, but its server was gone";
  EXPECT_THROW(static_cast<void>(clients_->find(0)), ProtocolError);
  EXPECT_THROW(static_cast<void>(clients_->find(2)), ProtocolError);
  EXPECT_EQ(clients_->tryFind(2), nullptr);
}

TEST_F(FarClientsTest, TheLimitCountsClientsThatExist) {
  for (const std::uint32_t number : {1u, 2u, 3u}) add(number, 1);

  EXPECT_EQ(refusalOf(4), FarewellCode::LIMIT);
  clients_->remove(2);
  EXPECT_EQ(refusalOf(4), std::nullopt);
}

TEST_F(FarClientsTest, ClientsOfABindingEndTogether) {
  add(1, 7);
  add(2, 8);
  add(3, 7);
  EXPECT_EQ(record_->clients, 3u);
  int seen = 0;
  clients_->forEachOf(7, [&](FarClient& client) { seen += static_cast<int>(client.number()); });
  EXPECT_EQ(seen, 1 + 3);

  clients_->dropAllOf(7);
  EXPECT_EQ(clients_->find(1), nullptr);
  EXPECT_EQ(clients_->find(3), nullptr);
  EXPECT_NE(clients_->find(2), nullptr);
  EXPECT_EQ(record_->clients, 1u);
  clients_->removeAllOf(8);
  EXPECT_EQ(clients_->find(2), nullptr);
  EXPECT_EQ(record_->clients, 0u);
}

}  // namespace
}  // namespace mpf::test
