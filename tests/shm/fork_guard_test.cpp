// SPDX-License-Identifier: MIT
// ForkGuard: detects in the child of a fork which objects the parent made. What the child keeps of
// them.
#include "shm/fork_guard.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <string>
#include <vector>

#include "base/system_call.h"
#include "shm/owner_lock.h"
#include "tests/shm/shm_fixture.h"
#include "tests/support/no_descriptors.h"

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

using LocksInAChildTest = ShmTest;

// A lock that the child kept would make a dead owner look alive.
TEST_F(LocksInAChildTest, AreGivenUpWithoutAFreeDescriptor) {
  std::vector<Segment> owned;
  std::vector<FileDescriptor> others;
  for (std::uint64_t key = 1; key <= 2; ++key) {
    const auto file = SegmentName::keyed(name(), NameKind::pendingBind, key);
    owned.push_back(createPage());
    owned.back().lockForLife();
    ASSERT_TRUE(owned.back().tryPublish(file));
    others.emplace_back(::open(segments::path(file).c_str(), O_RDWR | O_CLOEXEC));
    segments::remove(file);
  }
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe2(ends.data(), O_CLOEXEC), 0);
  const FileDescriptor fromChild(ends[0]);
  const FileDescriptor toParent(ends[1]);
  const auto child = [] {
    const NoDescriptors limit;
    return checkCall(::fork(), "fork");
  }();
  if (child == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    static_cast<void>(::write(toParent.get(), "", 1) == 1);
    for (;;) ::pause();
  }
  char one = 0;
  ASSERT_EQ(::read(fromChild.get(), &one, 1), 1);

  owned.clear();

  for (const auto& other : others) EXPECT_FALSE(owner_lock::isHeld(other.get()));
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
}

}  // namespace
}  // namespace mpf::test
