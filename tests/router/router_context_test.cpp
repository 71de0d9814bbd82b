// SPDX-License-Identifier: MIT
// Addresses as kj reads them, and addresses that plain TCP must not use.
#include "router/router_context.h"

#include <gtest/gtest.h>
#include <kj/async-io.h>
#include <stdexcept>

#include "router/transport/kj_text.h"

namespace mpf::router::test {
namespace {

TEST(HostForKj, PutsBracketsAroundIpv6Addresses) {
  EXPECT_EQ(hostForKj({"fd00::7", 1}), "[fd00::7]");
  EXPECT_EQ(hostForKj({"10.0.0.7", 1}), "10.0.0.7");
  EXPECT_EQ(hostForKj({"ioc1.lab", 1}), "ioc1.lab");
}

TEST(CheckPlain, RefusesPublicAddressesUnlessTheConfigurationAllowsThem) {
  auto io = kj::setupAsyncIo();
  auto& network = io.provider->getNetwork();
  auto own = network.parseAddress("127.0.0.1:1").wait(io.waitScope);
  auto open = network.parseAddress("8.8.8.8:1").wait(io.waitScope);
  RouterConfig config;

  EXPECT_NO_THROW(checkPlain(*own, config));
  EXPECT_THROW(checkPlain(*open, config), std::runtime_error);

  config.allowPublicPlain = true;
  EXPECT_NO_THROW(checkPlain(*open, config));
}

}  // namespace
}  // namespace mpf::router::test
