// SPDX-License-Identifier: MIT
// ForkGuard: detects in the child of a fork which objects the parent made.
#include "shm/fork_guard.h"

#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>
#include <string>

#include "base/system_call.h"

namespace mpf::test {
namespace {

// Whether `isTrue` returns true in a child process.
template <class IsTrue>
bool isTrueInAChild(const IsTrue& isTrue) {
  const auto child = checkCall(::fork(), "fork");
  if (child == 0) ::_exit(isTrue() ? 0 : 1);
  int status = 0;
  ::waitpid(child, &status, 0);
  return status == 0;
}

TEST(ForkGuardTest, AnObjectOfTheParentIsInherited) {
  const ForkGuard guard;

  EXPECT_TRUE(isTrueInAChild([&] { return guard.isInherited(); }));

  EXPECT_FALSE(guard.isInherited()) << "in the parent";
  EXPECT_NO_THROW(guard.check("object"));
}

TEST(ForkGuardTest, AnObjectOfTheChildIsNot) {
  EXPECT_TRUE(isTrueInAChild([] { return !ForkGuard().isInherited(); }));
}

TEST(ForkGuardTest, TheErrorNamesTheObject) {
  const ForkGuard guard;

  EXPECT_TRUE(isTrueInAChild([&] {
    try {
      guard.check("MessageServer");
    } catch (const std::logic_error& error) {
      return std::string(error.what()).starts_with("MessageServer: ");
    }
    return false;
  }));
}

}  // namespace
}  // namespace mpf::test
