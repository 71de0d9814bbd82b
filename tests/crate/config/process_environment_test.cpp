// SPDX-License-Identifier: MIT
// environmentOf: which value of a variable a process gets.
#include "crate/config/process_environment.h"

#include <unistd.h>

#include <cstdlib>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <optional>
#include <pwd.h>

namespace mpf::crate::test {
namespace {

using testing::Contains;
using testing::Not;
using testing::StartsWith;

// A variable of this process during a test.
class Variable {
 public:
  Variable(const char* name, const char* value) : name_(name) {
    if (const char* const before = std::getenv(name)) before_ = before;
    ::setenv(name, value, 1);
  }
  ~Variable() {
    if (before_) ::setenv(name_, before_->c_str(), 1);
    else ::unsetenv(name_);
  }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  const char* name_;
  std::optional<std::string> before_;
};

TEST(ProcessEnvironment, IsThatOfTheSupervisorWithThatOfThePlan) {
  const Variable inherited("MPF_TEST_A", "inherited=1");
  const Variable replaced("MPF_TEST_B", "inherited");
  ProcessPlan plan;
  plan.environment = {{"MPF_TEST_B", "of the plan"}, {"MPF_TEST_C", ""}};

  const auto variables = environmentOf(plan);

  EXPECT_THAT(variables, Contains("MPF_TEST_A=inherited=1"));
  EXPECT_THAT(variables, Contains("MPF_TEST_B=of the plan"));
  EXPECT_THAT(variables, Contains("MPF_TEST_C="));
  EXPECT_THAT(variables, Contains(StartsWith("MPF_TEST_B=")).Times(1));
}

TEST(ProcessEnvironment, HasNothingOfTheWatchdogOfTheSupervisor) {
  const Variable socket("NOTIFY_SOCKET", "/run/notify"), limit("WATCHDOG_USEC", "1000000");

  const auto variables = environmentOf(ProcessPlan());

  EXPECT_THAT(variables, Not(Contains(StartsWith("NOTIFY_SOCKET="))));
  EXPECT_THAT(variables, Not(Contains(StartsWith("WATCHDOG_USEC="))));
}

TEST(ProcessEnvironment, HasTheVariablesOfItsUserUnlessThePlanHasThem) {
  const auto* const user = ::getpwuid(::geteuid());
  if (user == nullptr) GTEST_SKIP() << "the user of this process has no entry";
  const Variable home("HOME", "/elsewhere"), name("USER", "other"), logName("LOGNAME", "other");
  ProcessPlan plan;
  plan.user = user->pw_name;
  plan.environment["LOGNAME"] = "of the plan";

  const auto variables = environmentOf(plan);

  EXPECT_THAT(variables, Contains("HOME=" + std::string(user->pw_dir)));
  EXPECT_THAT(variables, Contains("USER=" + plan.user));
  EXPECT_THAT(variables, Contains("LOGNAME=of the plan"));
  plan.user.clear();
  EXPECT_THAT(environmentOf(plan), Contains("HOME=/elsewhere"));
}

}  // namespace
}  // namespace mpf::crate::test
