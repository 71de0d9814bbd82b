// SPDX-License-Identifier: MIT
#include "drivers/serial/name_lookup.h"

#include <netinet/in.h>
#include <poll.h>

#include <gmock/gmock.h>

#include <mpf/file_descriptor.h>

#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

class NameLookupTest : public testing::Test {
 protected:
  static void waitUntilReadable(int descriptor) {
    pollfd ready{descriptor, POLLIN, 0};
    ASSERT_EQ(::poll(&ready, 1, -1), 1);
  }
  static NameLookup::Result resultFor(const TcpAddress& address) {
    NameLookup lookup(address);
    waitUntilReadable(lookup.descriptor());
    return lookup.tryTake().value();
  }

  Watchdog watchdog_{"name lookup test"};
};

// Numeric addresses need no name server.
TEST_F(NameLookupTest, GivesAnIpv4AddressWithItsPort) {
  const auto result = resultFor({"127.0.0.1", "4001"});

  EXPECT_EQ(result.problem, "");
  ASSERT_EQ(result.addresses.size(), 1U);
  const auto& found = result.addresses.front();
  ASSERT_EQ(found.storage.ss_family, AF_INET);
  EXPECT_EQ(found.length, sizeof(sockaddr_in));
  const auto& address = reinterpret_cast<const sockaddr_in&>(found.storage);
  EXPECT_EQ(ntohs(address.sin_port), 4001);
  EXPECT_EQ(ntohl(address.sin_addr.s_addr), INADDR_LOOPBACK);
}

TEST_F(NameLookupTest, GivesAnIpv6AddressWithItsPort) {
  const auto result = resultFor({"::1", "4001"});

  ASSERT_EQ(result.addresses.size(), 1U) << result.problem;
  const auto& found = result.addresses.front();
  ASSERT_EQ(found.storage.ss_family, AF_INET6);
  EXPECT_EQ(found.length, sizeof(sockaddr_in6));
  EXPECT_EQ(ntohs(reinterpret_cast<const sockaddr_in6&>(found.storage).sin6_port), 4001);
}

TEST_F(NameLookupTest, NamesTheAddressThatItCannotResolve) {
  const auto result = resultFor({"127.0.0.1", "no-such-service"});

  EXPECT_THAT(result.addresses, IsEmpty());
  EXPECT_THAT(result.problem, HasSubstr("resolve 127.0.0.1:no-such-service: "));
}

TEST_F(NameLookupTest, GivesItsResultOnce) {
  NameLookup lookup({"127.0.0.1", "4001"});
  waitUntilReadable(lookup.descriptor());

  EXPECT_TRUE(lookup.tryTake().has_value());
  EXPECT_FALSE(lookup.tryTake().has_value());
}

TEST_F(NameLookupTest, MayBeDestroyedBeforeTheLookupHasEnded) {
  std::optional<NameLookup> lookup;
  lookup.emplace(TcpAddress{"127.0.0.1", "4001"});
  const FileDescriptor ready(::dup(lookup->descriptor()));

  lookup.reset();

  waitUntilReadable(ready.get());
}

}  // namespace
}  // namespace mpf::test
