// SPDX-License-Identifier: MIT
// KjLog: kj's messages are written to the router's log.
#include "router/kj_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <kj/debug.h>
#include <string>

namespace mpf::router::test {
namespace {

MPF_KEEPS_KJ_LOG void logBoth(const Log& log) {
  const KjLog kjLog(log);
  KJ_LOG(WARNING, "careful");
  KJ_LOG(ERROR, "broken");
}

TEST(KjLog, WritesTheMessagesOfKj) {
  std::string said;

  logBoth(Log([&](Log::Level, const std::string& text) { said += text + '\n'; }));

  EXPECT_THAT(said, testing::HasSubstr("careful"));
  EXPECT_THAT(said, testing::HasSubstr("broken"));
}

}  // namespace
}  // namespace mpf::router::test
