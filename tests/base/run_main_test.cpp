// SPDX-License-Identifier: MIT
// runMain(), in a child process whose standard descriptors are closed or full.
#include "base/run_main.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <functional>
#include <gtest/gtest.h>
#include <stdexcept>
#include <string>

#include <mpf/file_descriptor.h>

#include "base/standard_descriptors.h"
#include "base/system_call.h"

namespace mpf {
namespace {

constexpr int kGood = 42;

// Runs `act` in a child. Returns its exit status, or minus the signal that killed it.
int endOf(const std::function<int()>& act) {
  std::fflush(nullptr);
  const auto child = checkCall(::fork(), "fork");
  if (child == 0) ::_exit(act());
  int status = 0;
  checkCall(::waitpid(child, &status, 0), "waitpid");
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

bool isNull(int descriptor) {
  struct stat status{};
  return ::fstat(descriptor, &status) == 0 && S_ISCHR(status.st_mode) &&
         status.st_rdev == makedev(1, 3);
}

void closeAll(unsigned subset) {
  for (int descriptor = 0; descriptor < 3; ++descriptor) {
    if ((subset >> descriptor & 1u) != 0) ::close(descriptor);
  }
}

void redirect(int descriptor, const char* path) { ::dup2(::open(path, O_WRONLY), descriptor); }

// Captures stderr.
class Errors {
 public:
  Errors() : file_(::memfd_create("stderr", MFD_CLOEXEC)) {}
  void take() const { ::dup2(file_.get(), STDERR_FILENO); }
  [[nodiscard]] std::string text() const {
    std::string text(static_cast<std::size_t>(::lseek(file_.get(), 0, SEEK_END)), '\0');
    text.resize(static_cast<std::size_t>(::pread(file_.get(), text.data(), text.size(), 0)));
    return text;
  }

 private:
  FileDescriptor file_;
};

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

TEST(CloseDescriptor, KeepsAStandardDescriptorNumberInUse) {
  const auto end = endOf([] {
    closeDescriptor(STDERR_FILENO);
    if (!isNull(STDERR_FILENO)) return 1;
    const int other = ::open("/dev/zero", O_RDONLY);
    closeDescriptor(other);
    return ::fcntl(other, F_GETFD) < 0 ? kGood : 2;
  });

  EXPECT_EQ(end, kGood);
}

}  // namespace
}  // namespace mpf
