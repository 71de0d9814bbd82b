// SPDX-License-Identifier: MIT
#include <mpf/drivers/serial/tcp_address.h>

#include <gtest/gtest.h>
#include <stdexcept>

namespace mpf {
namespace {

TEST(TcpAddress, HasHostAndPort) {
  EXPECT_EQ(TcpAddress::parse("moxa1.site:4001"), (TcpAddress{"moxa1.site", "4001"}));
  EXPECT_EQ(TcpAddress::parse("127.0.0.1:4001"), (TcpAddress{"127.0.0.1", "4001"}));
  EXPECT_EQ(TcpAddress::parse("[fe80::1]:4001"), (TcpAddress{"fe80::1", "4001"}));
  EXPECT_EQ(TcpAddress::parse("[::1]:4001").toString(), "[::1]:4001");
}

TEST(TcpAddress, HasAPortFrom1To65535OrAService) {
  for (const char* text : {"host:1", "host:65535", "host:telnet"})
    EXPECT_NO_THROW(static_cast<void>(TcpAddress::parse(text))) << text;
  for (const char* text : {"host:0", "host:65536", "host:82659", "host:99999999999999999999",
                           "host:-1", "host:+80", "host: 80"})
    EXPECT_THROW(static_cast<void>(TcpAddress::parse(text)), std::invalid_argument) << text;
}

TEST(TcpAddress, RefusesOtherTexts) {
  for (const char* text : {"", "host", "host:", ":4001", "::1:4001", "[]:1", "fe80::1"}) {
    EXPECT_THROW(static_cast<void>(TcpAddress::parse(text)), std::invalid_argument) << text;
  }
}

}  // namespace
}  // namespace mpf
