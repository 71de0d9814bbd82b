// SPDX-License-Identifier: MIT
// HOST:PORT, and which addresses are public.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "router/config/router_config.h"

namespace mpf::router::test {
namespace {

using testing::StartsWith;

std::string complaintOfAddress(const std::string& text) {
  try {
    static_cast<void>(parseAddress(text));
    return "nothing";
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
}

TEST(RouterAddress, IsANameAnIpv4OrAnIpv6Address) {
  EXPECT_EQ(parseAddress("ioc1.lab:9900"), (Address{"ioc1.lab", 9900}));
  EXPECT_EQ(parseAddress("my_ioc-2.:0"), (Address{"my_ioc-2.", 0}));
  EXPECT_EQ(parseAddress("10.0.0.7:65535"), (Address{"10.0.0.7", 65535}));
  EXPECT_EQ(parseAddress("[fd00::7]:9900"), (Address{"fd00::7", 9900}));
  EXPECT_EQ(parseAddress("[FD00:0::0007]:9900"), (Address{"fd00::7", 9900}));
  EXPECT_EQ(parseAddress("*:9900"), (Address{"*", 9900}));
}

TEST(RouterAddress, IsWrittenAsItIsRead) {
  for (const std::string text : {"ioc1.lab:9900", "10.0.0.7:1", "[fd00::7]:9900", "*:0"})
    EXPECT_EQ(parseAddress(text).text(), text);
}

TEST(RouterAddress, ErrorsQuoteTheTextAndShowTheForm) {
  const std::vector<std::pair<std::string, std::string>> wrong{
      {"",
       "\"\" has no port; write HOST:PORT, such as ioc1.lab:9900, 10.0.0.7:9900, [fd00::7]:9900 "
       "or, to listen, *:9900"},
      {"ioc1", "\"ioc1\" has no port;"},
      {"[fd00::7]", "\"[fd00::7]\" has no port;"},
      {"ioc1:", "\"ioc1:\" has no port from 0 to 65535 at its end;"},
      {"ioc1:65536", "\"ioc1:65536\" has no port from 0 to 65535 at its end;"},
      {"ioc1:-1", "\"ioc1:-1\" has no port from 0 to 65535 at its end;"},
      {"ioc1:99x", "\"ioc1:99x\" has no port from 0 to 65535 at its end;"},
      {":9900", "\":9900\" has no host before the port;"},
      {"10.0.0.777:1", "\"10.0.0.777:1\" has an invalid host, \"10.0.0.777\";"},
      {"10.0.7:1", "\"10.0.7:1\" has an invalid host, \"10.0.7\";"},
      {"a b:1", "\"a b:1\" has an invalid host, \"a b\";"},
      {"a..b:1", "\"a..b:1\" has an invalid host, \"a..b\";"},
      {"fd00::7:9900",
       "\"fd00::7:9900\" is an IPv6 address without brackets, or has more than one port;"},
      {"[fd00::7x]:1", "\"[fd00::7x]:1\" has no valid IPv6 address in its brackets;"},
      {"[10.0.0.7]:1", "\"[10.0.0.7]:1\" has no valid IPv6 address in its brackets;"},
      {"[fe80::1%eth0]:1", "\"[fe80::1%eth0]:1\" has no valid IPv6 address in its brackets;"},
      {"[:1", "\"[:1\" has no valid IPv6 address in its brackets;"},
  };
  for (const auto& [text, complaint] : wrong)
    EXPECT_THAT(complaintOfAddress(text), StartsWith(complaint));
}

TEST(RouterAddress, LoopbackPrivateAndLinkLocalAreNotPublic) {
  for (const auto* const ip :
       {"127.0.0.1", "127.255.255.254", "10.0.0.1", "172.16.0.1", "172.31.255.255", "192.168.1.1",
        "169.254.0.1", "::1", "fc00::1", "fdff::1", "fe80::1", "febf::1", "::ffff:10.0.0.1"}) {
    EXPECT_FALSE(isPublic(ip)) << ip;
  }
  for (const auto* const ip :
       {"0.0.0.0", "8.8.8.8", "11.0.0.1", "126.0.0.1", "128.0.0.1", "172.15.0.1", "172.32.0.1",
        "192.167.0.1", "169.253.0.1", "100.64.0.1", "::", "2001:db8::1", "fec0::1", "fe00::1",
        "ff02::1", "::ffff:8.8.8.8", "*", "ioc1.lab"}) {
    EXPECT_TRUE(isPublic(ip)) << ip;
  }
}

}  // namespace
}  // namespace mpf::router::test
