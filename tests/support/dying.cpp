// SPDX-License-Identifier: MIT
// Tests that die, each in another way. guard_test.cpp runs them. Each prints the names of its
// resources, on each line a word and a value.
#include <sched.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <gtest/gtest.h>
#include <iostream>
#include <iterator>
#include <string>
#include <thread>

#include "base/system_call.h"
#include "shm/segment.h"
#include "shm/segment_name.h"
#include "shm/window.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

// Creates a segment, a window on a backplane that is not registered with the guard, a folder, and a
// child that does not die with its parent.
class DyingTest : public testing::Test {
 protected:
  DyingTest() {
    segment_.lockForLife();
    EXPECT_TRUE(segment_.tryPublish("mpf." + backplane_.name() + ".s.0.left"));
    child_ = checkCall(::fork(), "fork");
    if (child_ == 0) {
      for (;;) ::pause();
    }
    std::cout << "other " << otherBackplane() << "\nbackplane " << backplane_.name() << "\nfolder "
              << folder_.path().string() << "\nchild " << child_ << std::endl;
  }

  static std::string otherBackplane() { return "dying-" + std::to_string(::getpid()); }

  TestBackplane backplane_;
  TemporaryFolder folder_;
  Segment segment_ = Segment::create(1 << 16, layout::SegmentKind::bulk, backplane_.name(), {});
  OwnWindow window_{otherBackplane(),
                    layout::SegmentKind::serverWindow,
                    SegmentName::serverWindow(otherBackplane(), 0, "left"),
                    {},
                    [](layout::SegmentHeader&) {}};
  pid_t child_ = 0;
};

// Whether this thread of the process exists and sleeps.
bool isAsleep(pid_t thread) {
  std::ifstream file("/proc/self/task/" + std::to_string(thread) + "/stat");
  const std::string stat{std::istreambuf_iterator<char>(file), {}};
  return stat.find(") S ") != std::string::npos;
}

TEST_F(DyingTest, Hangs) {
  std::atomic<pid_t> id{0};
  const std::jthread other([&] {
    id = ::gettid();
    for (;;) ::pause();
  });
  while (!isAsleep(id)) ::sched_yield();  // the test expects it in pause()
  const Watchdog watchdog("a test that", std::chrono::seconds(1));
  for (;;) ::pause();
}
TEST_F(DyingTest, IsKilled) { ::raise(SIGKILL); }
TEST_F(DyingTest, Ends) { ::_exit(3); }

}  // namespace
}  // namespace mpf::test
