// SPDX-License-Identifier: MIT
// The descriptors 0, 1 and 2 stay in use, in a child process that closes them.
#include "base/standard_descriptors.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "tests/base/child_process.h"

namespace mpf {
namespace {

using test::endOf;

constexpr int kRight = 43;

bool isOpen(int descriptor) { return ::fcntl(descriptor, F_GETFD) >= 0; }

TEST(OpenStandardDescriptors, OpensThoseThatAreClosedAndNoOthers) {
  for (unsigned closed = 0; closed < 8; ++closed) {
    const auto end = endOf([&] {
      for (int descriptor = 0; descriptor < 3; ++descriptor)
        test::redirect(descriptor, "/dev/zero");
      test::closeAll(closed);

      openStandardDescriptors();

      for (int descriptor = 0; descriptor < 3; ++descriptor) {
        if (!isOpen(descriptor)) return 1;
        if (test::isNull(descriptor) != ((closed >> descriptor & 1u) != 0)) return 2;
      }
      return kRight;
    });

    EXPECT_EQ(end, kRight) << "closed: " << closed;
  }
}

// A program may read from 0 and write to 1 and 2.
TEST(OpenStandardDescriptors, OpensThemForReadingAndWriting) {
  const auto end = endOf([] {
    test::closeAll(7);

    openStandardDescriptors();

    char byte = 'x';
    if (::read(STDIN_FILENO, &byte, 1) != 0) return 1;
    return ::write(STDOUT_FILENO, &byte, 1) == 1 && ::write(STDERR_FILENO, &byte, 1) == 1 ? kRight
                                                                                          : 2;
  });

  EXPECT_EQ(end, kRight);
}

// A child process that is started by exec() needs its standard descriptors, too.
TEST(OpenStandardDescriptors, AreInherited) {
  const auto end = endOf([] {
    test::closeAll(7);

    openStandardDescriptors();

    for (int descriptor = 0; descriptor < 3; ++descriptor) {
      if ((::fcntl(descriptor, F_GETFD) & FD_CLOEXEC) != 0) return 1;
    }
    return kRight;
  });

  EXPECT_EQ(end, kRight);
}

TEST(OpenStandardDescriptors, ReturnsWhenNoFileCanBeOpened) {
  const auto end = endOf([] {
    test::closeAll(7);
    const rlimit none{0, 0};
    if (::setrlimit(RLIMIT_NOFILE, &none) != 0) return 1;

    openStandardDescriptors();

    return isOpen(STDIN_FILENO) ? 2 : kRight;
  });

  EXPECT_EQ(end, kRight);
}

TEST(CloseDescriptor, KeepsAStandardDescriptorNumberInUse) {
  const auto end = endOf([] {
    closeDescriptor(STDERR_FILENO);
    if (!test::isNull(STDERR_FILENO)) return 1;
    const int other = ::open("/dev/zero", O_RDONLY);
    closeDescriptor(other);
    return isOpen(other) ? 2 : kRight;
  });

  EXPECT_EQ(end, kRight);
}

// /dev/null is opened once more for the replacement: that descriptor does not stay.
TEST(CloseDescriptor, LeavesNoOtherDescriptorOpen) {
  const auto end = endOf([] {
    const int next = ::dup(STDIN_FILENO);
    ::close(next);

    closeDescriptor(STDOUT_FILENO);

    return isOpen(next) ? 1 : kRight;
  });

  EXPECT_EQ(end, kRight);
}

TEST(CloseDescriptor, ClosesWhenNoOtherFileCanBeOpened) {
  const auto end = endOf([] {
    const rlimit none{0, 0};
    if (::setrlimit(RLIMIT_NOFILE, &none) != 0) return 1;

    closeDescriptor(STDOUT_FILENO);

    return isOpen(STDOUT_FILENO) ? 2 : kRight;
  });

  EXPECT_EQ(end, kRight);
}

}  // namespace
}  // namespace mpf
