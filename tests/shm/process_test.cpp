// SPDX-License-Identifier: MIT
// Process: the process that a header names, and whether it has ended.
#include "shm/process.h"

#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

#include <gtest/gtest.h>
#include <string>

#include "tests/shm/child.h"

namespace mpf::test {
namespace {

class ProcessTest : public testing::Test {
 protected:
  ProcessTest() { Process::self().describe(header_); }
  ~ProcessTest() override { ::munmap(&header_, sizeof header_); }

  // A header that this process and a child share.
  layout::SegmentHeader& header_ =
      *new (::mmap(nullptr, layout::kHeaderBytes, PROT_READ | PROT_WRITE,
                   MAP_SHARED | MAP_ANONYMOUS, -1, 0)) layout::SegmentHeader{};
};

TEST_F(ProcessTest, DescribesItselfInAHeader) {
  EXPECT_EQ(header_.ownerPid, ::getpid());
  EXPECT_EQ(header_.ownerUid, ::getuid());
  EXPECT_NE(header_.ownerStartTicks, 0u);
  EXPECT_EQ(header_.program, Process::self().program);
  EXPECT_STREQ(header_.program.data(), ::program_invocation_short_name);
}

TEST_F(ProcessTest, ALivingProcessHasNotEnded) {
  EXPECT_FALSE(Process::hasEnded(header_));
  EXPECT_TRUE(Process::openOwner(header_));
}

TEST_F(ProcessTest, TheDescriptorOfAProcessIsReadableWhenItEnds) {
  Child child([this](Child::Self& self) {
    Process::self().describe(header_);
    self.stay();
  });
  EXPECT_EQ(header_.ownerPid, child.pid()) << "self() is read again after a fork";
  const auto owner = Process::openOwner(header_);
  ASSERT_TRUE(owner);
  EXPECT_FALSE(Process::hasEnded(header_));

  child.end(SIGKILL);

  pollfd ended{owner.get(), POLLIN, 0};
  EXPECT_EQ(::poll(&ended, 1, -1), 1);
  EXPECT_TRUE(Process::hasEnded(header_));
  EXPECT_FALSE(Process::openOwner(header_));
}

TEST_F(ProcessTest, APidThatAnotherProcessHasNowProvesTheEnd) {
  header_.ownerStartTicks = 1;

  EXPECT_TRUE(Process::hasEnded(header_));
  EXPECT_FALSE(Process::openOwner(header_));
}

TEST_F(ProcessTest, NothingIsProvenAboutAProcessOfAnotherPidNamespace) {
  header_.ownerStartTicks = 1;
  ++header_.pidNamespace;

  EXPECT_FALSE(Process::hasEnded(header_));
  EXPECT_FALSE(Process::openOwner(header_));
}

TEST_F(ProcessTest, NothingIsProvenByAHeaderThatNamesNoProcess) {
  header_.ownerPid = 0;

  EXPECT_FALSE(Process::hasEnded(header_));
  EXPECT_FALSE(Process::openOwner(header_));
}

}  // namespace
}  // namespace mpf::test
