// SPDX-License-Identifier: MIT
// Which servers of this host a peer may use.
#include "router/config/access.h"

#include <gtest/gtest.h>

namespace mpf::router::test {
namespace {

RouterConfig served(std::vector<Allow> allow) {
  RouterConfig config;
  config.serve = {{.location = 1, .local = 0}, {.location = 2, .local = 7}};
  config.allow = std::move(allow);
  return config;
}

TEST(FindAllowed, WithoutRulesPermitsAllServedLocations) {
  const auto config = served({});

  EXPECT_EQ(findAllowed(config, "", 1, "echo"), &config.serve[0]);
  EXPECT_EQ(findAllowed(config, "anybody", 2, "echo"), &config.serve[1]);
  EXPECT_EQ(findAllowed(config, "anybody", 3, "echo"), nullptr) << "not served";
}

TEST(FindAllowed, PermitsWhatOneOfTheRulesPermits) {
  const auto config = served({{.peer = "ioc*", .locations = {1}, .servers = {"serial*", "gpib"}},
                              {.peer = "lab", .locations = {}, .servers = {"*"}}});

  EXPECT_TRUE(findAllowed(config, "ioc1", 1, "serial0"));
  EXPECT_TRUE(findAllowed(config, "ioc1", 1, "gpib"));
  EXPECT_FALSE(findAllowed(config, "ioc1", 1, "dac")) << "another server";
  EXPECT_FALSE(findAllowed(config, "ioc1", 2, "gpib")) << "another location";
  EXPECT_FALSE(findAllowed(config, "other", 1, "gpib")) << "another peer";
  EXPECT_FALSE(findAllowed(config, "", 1, "gpib")) << "plain TCP";
  EXPECT_TRUE(findAllowed(config, "lab", 2, "dac")) << "a rule without locations is for all";
  EXPECT_FALSE(findAllowed(config, "lab", 3, "dac")) << "not served";
}

TEST(FindAllowed, AStarForThePeerPermitsPlainTcp) {
  const auto config = served({{.peer = "*", .locations = {}, .servers = {"echo"}}});

  EXPECT_TRUE(findAllowed(config, "", 1, "echo"));
  EXPECT_FALSE(findAllowed(config, "", 1, "dac"));
}

}  // namespace
}  // namespace mpf::router::test
