// SPDX-License-Identifier: MIT
// runMain(), in a child process whose standard descriptors are closed or full.
#include "base/run_main.h"

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <gtest/gtest.h>
#include <stdexcept>

#include "tests/base/child_process.h"

namespace mpf {
namespace {

using test::closeAll;
using test::endOf;
using test::Errors;
using test::isNull;
using test::redirect;

constexpr int kGood = 42;

TEST(RunMain, OpensTheStandardDescriptorsThatAreClosed) {
  for (unsigned subset = 0; subset < 8; ++subset) {
    const auto end = endOf([&] {
      closeAll(subset);
      return runMain("x", [&] {
        for (int descriptor = 0; descriptor < 3; ++descriptor) {
          if ((subset >> descriptor & 1u) != 0 && !isNull(descriptor)) return 1;
        }
        return ::open("/dev/zero", O_RDONLY) > 2 ? kGood : 2;
      });
    });

    EXPECT_EQ(end, kGood) << "closed: " << subset;
  }
}

TEST(RunMain, LeavesOpenDescriptorsUnchanged) {
  const auto end = endOf([] {
    redirect(STDOUT_FILENO, "/dev/zero");
    return runMain("x", [] { return isNull(STDOUT_FILENO) ? 1 : kGood; });
  });

  EXPECT_EQ(end, kGood);
}

TEST(RunMain, ReportsAnExceptionAsOneLineAndAStatus) {
  const Errors errors;

  const auto failed = endOf([&] {
    return errors.take(), runMain("x", []() -> int { throw std::runtime_error("bad \x1b[2J"); });
  });
  const auto wrong = endOf([&] {
    return errors.take(), runMain("x", []() -> int { throw std::invalid_argument("odd"); });
  });
  const auto unknown = endOf([&] { return errors.take(), runMain("x", []() -> int { throw 1; }); });

  EXPECT_EQ(failed, kExitFailed);
  EXPECT_EQ(wrong, kExitUsage);
  EXPECT_EQ(unknown, kExitFailed);
  EXPECT_EQ(errors.text(), "x: bad \\x1b[2J\nx: odd\nx: failed with an unknown exception\n");
}

TEST(RunMain, ReturnsTheStatusEvenIfStderrCannotBeWritten) {
  const auto fail = [] {
    return runMain("x", []() -> int { throw std::invalid_argument("odd"); });
  };

  EXPECT_EQ(endOf([&] { return closeAll(4), fail(); }), kExitUsage);
  EXPECT_EQ(endOf([&] { return redirect(STDERR_FILENO, "/dev/full"), fail(); }), kExitUsage);
  EXPECT_EQ(endOf([&] { return redirect(STDERR_FILENO, "/dev/null"), fail(); }), kExitUsage);
}

TEST(RunMain, FailsIfOutputCannotBeWritten) {
  const Errors errors;

  const auto end = endOf([&] {
    errors.take();
    redirect(STDOUT_FILENO, "/dev/full");
    return runMain("x",
                   [] { return std::printf("a line that waits in the buffer\n") > 0 ? 0 : kGood; });
  });

  EXPECT_EQ(end, kExitFailed);
  EXPECT_EQ(errors.text(),
            "x: standard output: not everything could be written: No space left on device\n");
}

}  // namespace
}  // namespace mpf
