// SPDX-License-Identifier: MIT
// CrateFolder: where it is, and its lock.
#include "crate/supervisor/crate_folder.h"

#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/system_call.h"
#include "tests/support/temporary_folder.h"

namespace mpf::crate::test {
namespace {

using mpf::test::TemporaryFolder;
using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(CrateFolder, IsInTheFolderOfCrates) {
  ::setenv("MPF_CRATES", "/a/b", 1);
  EXPECT_EQ(CrateFolder::of("lab").path(), "/a/b/lab");
  EXPECT_EQ(CrateFolder::of("lab").name(), "lab");
  EXPECT_EQ(CrateFolder::of("lab").log("dac"), "/a/b/lab/dac.log");
}

TEST(CrateFolder, IsForItsUserOnly) {
  const TemporaryFolder parent;
  const CrateFolder folder(parent.path() / "x/lab");

  folder.create();
  folder.create();

  struct stat status{};
  ASSERT_EQ(::stat(folder.path().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0700U);
}

// A supervisor, which has a child, in processes of their own.
class OtherSupervisor {
 public:
  explicit OtherSupervisor(const CrateFolder& folder) {
    std::array<int, 2> pipe{};
    checkCall(::pipe(pipe.data()), "pipe");
    supervisor_ = checkCall(::fork(), "fork");
    if (supervisor_ == 0) {
      const auto lock = folder.lock();
      const auto child = ::fork();
      if (child == 0)
        for (;;) ::pause();
      [[maybe_unused]] const auto written = ::write(pipe[1], &child, sizeof child);
      for (;;) ::pause();
    }
    EXPECT_EQ(::read(pipe[0], &child_, sizeof child_), static_cast<ssize_t>(sizeof child_));
    for (const int end : pipe) ::close(end);
  }
  ~OtherSupervisor() { ::kill(child_, SIGKILL); }
  void kill() const {
    ::kill(supervisor_, SIGKILL);
    ::waitpid(supervisor_, nullptr, 0);
  }

 private:
  pid_t supervisor_ = 0, child_ = 0;
};

TEST(CrateFolder, HasOneSupervisor) {
  const TemporaryFolder parent;
  const CrateFolder folder(parent.path() / "lab");
  folder.create();
  EXPECT_FALSE(folder.isLocked());

  const OtherSupervisor supervisor(folder);

  EXPECT_TRUE(folder.isLocked());
  EXPECT_THAT([&] { static_cast<void>(folder.lock()); },
              ThrowsMessage<std::runtime_error>(
                  HasSubstr("the crate \"lab\" is already running in " + folder.path().string())));
  supervisor.kill();
  EXPECT_FALSE(folder.isLocked()) << "the child of the supervisor holds no lock";
  EXPECT_NO_THROW(static_cast<void>(folder.lock()));
}

// As for a user who may not read the folder; this error concerns root, too.
TEST(CrateFolder, ThatCannotBeSeenIsNotTakenForOneThatIsNotLocked) {
  const TemporaryFolder parent;
  const auto path = parent.write("file", "");
  const CrateFolder folder(path);
  ::setenv("MPF_CRATES", path.c_str(), 1);

  EXPECT_THAT([&] { static_cast<void>(folder.isLocked()); },
              ThrowsMessage<std::system_error>(HasSubstr("open " + path + "/lock: ")));
  EXPECT_THAT([] { static_cast<void>(CrateFolder::all()); },
              ThrowsMessage<std::system_error>(HasSubstr("list " + path + ": ")));
}

TEST(CrateFolder, AllAreListed) {
  const TemporaryFolder parent;
  ::setenv("MPF_CRATES", parent.path().c_str(), 1);
  EXPECT_TRUE(CrateFolder::all().empty());
  CrateFolder::of("b").create();
  CrateFolder::of("a").create();
  static_cast<void>(parent.write("file", ""));

  const auto all = CrateFolder::all();

  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].name() + all[1].name(), "ab");
}

}  // namespace
}  // namespace mpf::crate::test
