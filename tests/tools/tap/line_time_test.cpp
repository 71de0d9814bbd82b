// SPDX-License-Identifier: MIT
// LineTime: times that a server chose, which may be any.
#include "tools/tap/line_time.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>

namespace mpf::tools {
namespace {

using testing::HasSubstr;

TEST(LineTime, AnyTimeHasAText) {
  LineTime time(std::int64_t{1} << 60);

  EXPECT_THAT(time.of(std::numeric_limits<std::int64_t>::max()), HasSubstr(" +0.0 ms"));
  EXPECT_THAT(time.of(std::numeric_limits<std::int64_t>::min()), HasSubstr(" -9223372036854.8 ms"));
}

}  // namespace
}  // namespace mpf::tools
