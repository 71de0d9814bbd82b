// SPDX-License-Identifier: MIT
// Texts of peers and of kj's exceptions, as they are shown.
#include "router/transport/kj_text.h"

#include <gtest/gtest.h>
#include <kj/debug.h>
#include <string>

namespace mpf::router::test {
namespace {

using namespace std::chrono_literals;

TEST(DisplayText, EscapesControlCharacters) {
  EXPECT_EQ(displayText(std::string("a\n\x1b[2J")), R"(a\n\x1b[2J)");
}

TEST(DisplayText, HasAtMost200Bytes) {
  EXPECT_EQ(displayText(std::string(200, 'x')), std::string(200, 'x'));
  EXPECT_EQ(displayText(std::string(201, 'x')), std::string(200, 'x'));
  EXPECT_EQ(displayText(std::string(200, '\n')).size(), 200u) << "escaped, they are 400";
}

TEST(DisplayText, IsCutBetweenTwoCharacters) {
  EXPECT_EQ(displayText(std::string(199, 'x') + "é"), std::string(199, 'x'));
  EXPECT_EQ(displayText(std::string(198, 'x') + "é!"), std::string(198, 'x') + "é");
}

TEST(ReasonOf, LeavesOutTheNamesOfCallsAndVariables) {
  EXPECT_EQ(reasonOf(KJ_EXCEPTION(FAILED, "connect(): Connection refused")), "Connection refused");
  EXPECT_EQ(reasonOf(KJ_EXCEPTION(
                FAILED,
                "::bind(sockfd, &addr, length): Address already in use; toString() = 127.0.0.1:1")),
            "Address already in use");
  EXPECT_EQ(reasonOf(KJ_EXCEPTION(OVERLOADED, "operation timed out")), kTimeout);
  EXPECT_EQ(reasonOf(KJ_EXCEPTION(FAILED, "something else; whatever")), "something else; whatever");
}

TEST(ToKj, ConvertsNanoseconds) { EXPECT_EQ(toKj(1500us), 1'500'000 * kj::NANOSECONDS); }

}  // namespace
}  // namespace mpf::router::test
