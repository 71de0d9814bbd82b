// SPDX-License-Identifier: MIT
// A router with slow name look-ups: a look-up that is no longer needed is cancelled, and its result
// is ignored.
#include "router/router.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <kj/debug.h>
#include <memory>
#include <optional>
#include <stdexcept>

#include "tests/router/held_network.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::router::test {
namespace {

class HeldRouterTest : public testing::Test {
 public:
  ~HeldRouterTest() noexcept override = default;

 protected:
  [[nodiscard]] RouterConfig config() const {
    RouterConfig config;
    config.backplane = backplane_.name();
    config.name = "test";
    return config;
  }
  [[nodiscard]] RouterConfig withRemote() const {
    auto with = config();
    with.remotes.push_back({.locations = {1},
                            .address = parseAddress("slow.lab:9900"),
                            .security = Security::plain,
                            .tlsName = {}});
    return with;
  }
  [[nodiscard]] RouterConfig withListener() const {
    auto with = config();
    with.listen.push_back({.address = parseAddress("slow.lab:9900"), .security = Security::plain});
    return with;
  }
  [[nodiscard]] auto& lookups() { return io_.network().lookups; }
  void fail(std::size_t lookup) {
    lookups()[lookup]->reject(KJ_EXCEPTION(FAILED, "no such name"));
    io_.run();
  }

  const mpf::test::Watchdog watchdog_{
      testing::UnitTest::GetInstance()->current_test_info()->name()};
  const mpf::test::TestBackplane backplane_;
  std::string said_;
  bool isFull_ = false;  // the log has no room for another line
  const Log log_{[this](Log::Level, const std::string& text) {
    if (isFull_) throw std::runtime_error("no room");
    said_ += text + '\n';
  }};
  HeldIo io_;
  std::optional<Router> router_{std::in_place, io_.context(), config(), log_};
};

using SlowLookupTest = HeldRouterTest;

TEST_F(SlowLookupTest, EndsWhenAReloadRemovesItsListener) {
  router_->reload(withListener());
  ASSERT_EQ(lookups().size(), 1u);

  router_->reload(config());
  EXPECT_FALSE(lookups()[0]->isWaiting());
  fail(0);

  EXPECT_EQ(said_, "");
}

TEST_F(SlowLookupTest, EndsWithTheRouter) {
  router_->reload(withListener());

  auto stopped = router_->stop();
  ASSERT_FALSE(lookups()[0]->isWaiting());

  stopped.wait(io_.context().waitScope);
  EXPECT_EQ(said_, "");
}

// While start() waits for the look-up.
TEST_F(SlowLookupTest, EndsWithTheRouterDuringItsStart) {
  router_.emplace(io_.context(), withListener(), log_);
  auto started = router_->start();

  router_->stop().wait(io_.context().waitScope);

  EXPECT_FALSE(lookups()[0]->isWaiting());
  EXPECT_ANY_THROW(started.wait(io_.context().waitScope));
}

TEST_F(SlowLookupTest, ThatFailsIsLoggedAndRepeatedByTheNextReload) {
  router_->reload(withListener());
  fail(0);
  EXPECT_THAT(said_, testing::HasSubstr("slow.lab:9900: no such name"));
  EXPECT_TRUE(router_->listening().empty());

  router_->reload(withListener());
  ASSERT_EQ(lookups().size(), 2u);
  lookups()[1]->fulfill(io_.addressOf("127.0.0.1:0"));
  io_.run();

  ASSERT_EQ(router_->listening().size(), 1u);
  EXPECT_NE(router_->listening()[0].port, 9900) << "it listens";
}

TEST_F(SlowLookupTest, IsRepeatedForAListenerThatIsAddedAgain) {
  router_->reload(withListener());
  router_->reload(config());
  router_->reload(withListener());
  io_.run();

  ASSERT_EQ(lookups().size(), 2u);
  EXPECT_TRUE(lookups()[1]->isWaiting());
  EXPECT_EQ(router_->listening().size(), 1u);
}

TEST_F(SlowLookupTest, ThatFailsIsLoggedWithItsStepAndReason) {
  router_->reload(withRemote());
  lookups()[0]->reject(KJ_EXCEPTION(FAILED,
                                    "DNS lookup failed.; params.host = slow.lab; "
                                    "gai_strerror(status) = Name or service not known"));
  io_.run();

  EXPECT_EQ(
      said_,
      "cannot reach slow.lab:9900: the look-up of slow.lab failed: Name or service not known\n");
}

using ReloadTest = HeldRouterTest;

TEST_F(ReloadTest, WarnsAsLongAsTheFileHasAnotherName) {
  auto renamed = config();
  renamed.name = "another";

  for (int reloads = 0; reloads < 2; ++reloads) {
    said_.clear();
    router_->reload(renamed);
    EXPECT_THAT(said_, testing::HasSubstr("the name is still test"));
  }

  said_.clear();
  router_->reload(config());
  EXPECT_EQ(said_, "");
}

// For example when the end of a connection cannot be logged: otherwise the router would keep
// running without reconnecting.
using RemoteTest = HeldRouterTest;

TEST_F(RemoteTest, EndsTheProgramWhenItCannotContinue) {
  isFull_ = true;
  router_->reload(withRemote());
  ASSERT_EQ(lookups().size(), 1u);

  EXPECT_ANY_THROW(fail(0));
}

}  // namespace
}  // namespace mpf::router::test
