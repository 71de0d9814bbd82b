// SPDX-License-Identifier: MIT
// IocClients: which callers share a connection, and how long a connection exists.
#include "epics/ioc_clients.h"

#include <cstdio>
#include <cstdlib>
#include <epicsStdio.h>
#include <gmock/gmock.h>
#include <initHooks.h>
#include <memory>

#include "tests/epics/epics_fixture.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;

std::string reportOf(const IocClients& clients) {
  char* text = nullptr;
  std::size_t size = 0;
  auto* const stream = ::open_memstream(&text, &size);
  epicsSetThreadStdout(stream);
  clients.print(0);
  epicsSetThreadStdout(nullptr);
  std::fclose(stream);
  const std::unique_ptr<char, decltype(&std::free)> owner(text, &std::free);
  return text;
}

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

TEST_F(IocClientsTest, TheReportCountsTheRecordsOfAConnection) {
  const std::string device = "field(DTYP, \"ip330Scan\") field(INP, ";
  const Ioc ioc("record(ai, \"a\") {" + device + "\"#C0 S0 @adc\") }" +  //
                "record(ai, \"b\") {" + device + "\"#C0 S0 @dac\") }" +  //
                "record(ai, \"c\") {" + device + "\"#C0 S1 @dac\") }");

  const auto report = reportOf(IocClients::instance());

  EXPECT_THAT(report, HasSubstr("server \"adc\" at location 0: 1 record, server"));
  EXPECT_THAT(report, HasSubstr("server \"dac\" at location 0: 2 records, server"));
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

// Other IOCs announce the shutdown as well, while scans and clients may still process records.
TEST_F(IocClientsTest, DevicesExistUntilRecordsAreFreed) {
  const Ioc ioc("record(ai, \"a\") { field(DTYP, \"ip330Scan\") field(INP, \"#C0 S0 @adc\") }");
  DBADDR address;
  ASSERT_EQ(dbNameToAddr("a", &address), 0);
  const auto* const device = address.precord->dpvt;
  ASSERT_NE(device, nullptr);

  IocClients::instance().onHook(initHookAtShutdown);
  IocClients::instance().onHook(initHookAfterShutdown);

  EXPECT_EQ(address.precord->dpvt, device);
  static_cast<void>(Ioc::put("a.PROC", "1"));
  EXPECT_EQ(Ioc::get("a.STAT"), "COMM");
}

}  // namespace
}  // namespace mpf::test
