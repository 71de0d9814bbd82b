// SPDX-License-Identifier: MIT
// A router whose start waits for the look-up of a name.
#include <fcntl.h>
#include <sys/stat.h>

#include "tests/support/temporary_folder.h"
#include "tests/system/router_fixture.h"

namespace mpf::test {
namespace {

// The router looks up the name on which it listens. Without an answer of a name server this may
// take minutes.
class RouterSlowStartTest : public testing::TestWithParam<int> {
 protected:
  RouterSlowStartTest() {
    checkCall(::mkfifo(fifo_.c_str(), 0600), "mkfifo", fifo_);
    ::setenv("LD_PRELOAD", MPF_TEST_HELD_LOOKUP, 1);
    ::setenv("MPF_TEST_HELD_LOOKUP", fifo_.c_str(), 1);
  }
  ~RouterSlowStartTest() override {
    ::unsetenv("LD_PRELOAD");
    ::unsetenv("MPF_TEST_HELD_LOOKUP");
  }

  const Watchdog watchdog_{"slow start"};
  const TestBackplane backplane_;
  const TemporaryFolder folder_;
  const std::string fifo_ = folder_.file("lookup");
};
INSTANTIATE_TEST_SUITE_P(At, RouterSlowStartTest, testing::Values(SIGTERM, SIGINT));

TEST_P(RouterSlowStartTest, EndsOnASignal) {
  const std::vector<std::string> words{
      "--backplane", backplane_.name(), "--listen", "name.held:0", "--serve", "1", "--plain"};
  Victim router(MPF_TEST_ROUTER, words);
  const FileDescriptor lookup(checkCall(::open(fifo_.c_str(), O_WRONLY | O_CLOEXEC), "open",
                                        fifo_));  // returns when the router opens it

  EXPECT_EQ(router.end(GetParam()), 0);
}

}  // namespace
}  // namespace mpf::test
