// SPDX-License-Identifier: MIT
#include "client/callback_errors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdexcept>

namespace mpf::test {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

class CallbackErrorsTest : public testing::Test {
 protected:
  // Reports an exception, as a dispatcher does.
  template <class Exception>
  void reportThrown(const Exception& exception) {
    try {
      throw exception;
    } catch (...) {
      errors_.report();
    }
  }
  // What `work` writes to stderr.
  template <class Work>
  static std::string stderrOf(const Work& work) {
    testing::internal::CaptureStderr();
    work();
    return testing::internal::GetCapturedStderr();
  }

  CallbackErrors errors_;
};

TEST_F(CallbackErrorsTest, AReportNamesTheClientAndTheException) {
  errors_.note("dac", 3);

  const auto written = stderrOf([&] { reportThrown(std::runtime_error("no such record")); });

  EXPECT_EQ(
      written,
      "mpf: the callback of the client of server \"dac\" at location 3 threw an exception: no "
      "such record. The dispatcher continues; catch the exception in the callback.\n");
}

TEST_F(CallbackErrorsTest, AReportNamesTheClientThatWasNotedForItOnly) {
  errors_.note("dac", 3);
  static_cast<void>(stderrOf([&] { reportThrown(std::runtime_error("first")); }));

  const auto written = stderrOf([&] { reportThrown(std::runtime_error("second")); });

  EXPECT_THAT(written, StartsWith("mpf: the callback threw an exception: second."));
}

TEST_F(CallbackErrorsTest, AnExceptionOfAnotherTypeIsReportedToo) {
  EXPECT_THAT(stderrOf([&] { reportThrown(42); }), HasSubstr("exception: not a std::exception."));
}

TEST_F(CallbackErrorsTest, RepeatedReportsAreHeldAndCountedInOneLine) {
  EXPECT_EQ(errors_.dueNs(), INT64_MAX);
  static_cast<void>(stderrOf([&] {
    for (int i = 0; i < LogLimiter::kAtOnce; ++i) reportThrown(std::runtime_error("again"));
  }));

  const auto held = stderrOf([&] {
    for (int i = 0; i < 5; ++i) reportThrown(std::runtime_error("again"));
  });
  EXPECT_THAT(held, IsEmpty());
  EXPECT_NE(errors_.dueNs(), INT64_MAX);
  const auto written = stderrOf([&] { errors_.writeHeld(); });

  EXPECT_THAT(written, HasSubstr("exception: again."));
  EXPECT_THAT(written, HasSubstr(" (repeated 5 times in "));
  EXPECT_THAT(written, EndsWith(" s)\n"));
  EXPECT_EQ(errors_.dueNs(), INT64_MAX);
  EXPECT_THAT(stderrOf([&] { errors_.writeHeld(); }), IsEmpty());
}

}  // namespace
}  // namespace mpf::test
