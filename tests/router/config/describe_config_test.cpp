// SPDX-License-Identifier: MIT
// describe(): a line for each part of a configuration.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "router/config/router_config.h"
#include "tests/router/certificates.h"
#include "tests/support/temporary_folder.h"

namespace mpf::router::test {
namespace {

using testing::HasSubstr;
using testing::Not;

RouterConfig plainConfig() {
  RouterConfig config;
  config.name = "crate 7";
  config.backplane = "crate7";
  config.serve = {{1, 1}, {3, 0}};
  config.listen = {{{"127.0.0.1", 9900}, Security::plain}};
  config.remotes = {{{2}, {"fd00::7", 9901}, Security::plain, {}}};
  config.allow = {{.peer = "*", .locations = {1, 3}, .servers = {"serial*", "dac"}}, {}};
  return config;
}

TEST(DescribeConfig, HasALineForEachPart) {
  EXPECT_EQ(describe(plainConfig()),
            "router      crate 7, on backplane crate7, clients of this host: mode 0600\n"
            "serves      location 1, 3 (here 0)\n"
            "listens     127.0.0.1:9900, plain TCP\n"
            "allows      * to bind to serial*, dac at location 1, 3\n"
            "allows      * to bind to * at all locations\n"
            "connects    [fd00::7]:9901, plain TCP, for location 2\n"
            "limits      queue-size 256 buffer-size 1MiB max-message-size 64MiB window-size 4MiB "
            "max-clients 16000 max-connections 1000 dead-time 2s handshake-time 5s "
            "first-retry 100ms last-retry 5s\n");
}

TEST(DescribeConfig, NamesTheBackplaneOfTheEnvironmentAndTheGroup) {
  auto config = plainConfig();
  config.backplane.clear();
  config.rights = {.mode = 0660, .group = 0};

  EXPECT_THAT(
      describe(config),
      HasSubstr("on backplane $MPF_BACKPLANE or default, clients of this host: mode 0660, group "
                "root\n"));
}

TEST(DescribeConfig, OmitsServedLocationsOfARouterThatOnlyConnects) {
  auto config = plainConfig();
  config.serve.clear();
  config.remotes[0].locations = {2, -7};

  EXPECT_THAT(describe(config), Not(HasSubstr("serves")));
  EXPECT_THAT(describe(config), HasSubstr(", for locations 2, -7\n"));
}

TEST(DescribeConfig, ShowsTheOwnCertificateAndTheNameExpectedOfARemote) {
  const mpf::test::TemporaryFolder folder;
  auto config = plainConfig();
  config.tls = Certificates(folder, "all").files("ioc1");
  EXPECT_THAT(describe(config), Not(HasSubstr("certificate")));

  config.remotes[0].security = Security::tls;
  config.remotes[0].tlsName = "ioc7.lab";

  EXPECT_THAT(describe(config),
              HasSubstr("connects    [fd00::7]:9901, TLS, certificate of ioc7.lab, for location"));
  EXPECT_THAT(describe(config), HasSubstr("\ncertificate ioc1, valid until "));
}

}  // namespace
}  // namespace mpf::router::test
