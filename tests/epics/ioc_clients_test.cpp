// SPDX-License-Identifier: MIT
// IocClients: which callers share a connection, and how long a connection exists.
#include "epics/ioc_clients.h"

#include "tests/epics/epics_fixture.h"

namespace mpf::test {
namespace {

using IocClientsTest = EpicsTest;

TEST_F(IocClientsTest, CallersWithTheSameArgumentsShareAConnection) {
  auto& clients = IocClients::instance();
  const Ioc ioc("");

  const auto shared = clients.connectionTo("adc", 1, "");
  const auto own = clients.connectionTo("adc", 1, "v");

  EXPECT_EQ(clients.connectionTo("adc", 1, ""), shared);
  EXPECT_EQ(clients.connectionTo("adc", 1, "v"), own);
  EXPECT_NE(own, shared);
  EXPECT_NE(clients.connectionTo("dac", 1, ""), shared);
  EXPECT_NE(clients.connectionTo("adc", 2, ""), shared);
  EXPECT_EQ(shared->server(), "adc");
  EXPECT_EQ(shared->location(), 1);
}

// Connections exist as long as the IOC, even if no record uses them.
TEST_F(IocClientsTest, ConnectionsEndWithTheIoc) {
  auto& clients = IocClients::instance();
  std::weak_ptr<SharedClient> connection;
  {
    const Ioc ioc("");
    connection = clients.connectionTo("adc", 0, "");
    EXPECT_FALSE(connection.expired());
  }
  EXPECT_TRUE(connection.expired());

  const Ioc next("");
  EXPECT_NE(clients.connectionTo("adc", 0, ""), nullptr);
}

}  // namespace
}  // namespace mpf::test
