// SPDX-License-Identifier: MIT
// CapsuleStore: limits by number and size, and rights.
#include "crate/capsule/capsule_store.h"

#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <gtest/gtest.h>
#include <system_error>

#include "tests/support/temporary_folder.h"

namespace mpf::crate::test {
namespace {

const nlohmann::ordered_json kCapsule{{"process", "a/b"}, {"pid", 7}};

TEST(CapsuleStore, RemovesTheOldestAboveTheNumber) {
  const mpf::test::TemporaryFolder files;
  const CapsuleStore store(files.path() / "capsules", 2);
  EXPECT_TRUE(store.list().empty());
  store.add(kCapsule);
  const auto second = store.add(kCapsule);

  const auto third = store.add(kCapsule);

  EXPECT_EQ(store.list(), (std::vector{second, third}));
  struct stat status{};
  ASSERT_EQ(::stat(third.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0600u);
}

TEST(CapsuleStore, RemovesTheOldestAboveTheSizeButKeepsTheNewest) {
  const mpf::test::TemporaryFolder files;
  const CapsuleStore store(files.path(), 100, 10);
  store.add(kCapsule);

  const auto second = store.add(kCapsule);

  EXPECT_EQ(store.list(), std::vector{second});
}

TEST(CapsuleStore, TheNewestSortsLastAfterTheClockWasSetBack) {
  const mpf::test::TemporaryFolder files;
  const CapsuleStore store(files.path(), 2);
  static_cast<void>(files.write("09000000000000000000-a-1.capsule.json", "{}"));
  const auto future = files.write("09000000000000000001-a-1.capsule.json", "{}");

  const auto newest = store.add(kCapsule);

  EXPECT_EQ(store.list(), (std::vector{future, newest}));
}

TEST(CapsuleStore, KeepsTheNewestBesideFilesOfOtherNames) {
  const mpf::test::TemporaryFolder files;
  const CapsuleStore store(files.path(), 1);
  static_cast<void>(files.write("copy.capsule.json", "{}"));

  const auto newest = store.add(kCapsule);

  EXPECT_EQ(store.list(), std::vector{newest});
}

TEST(CapsuleStore, AFailedWriteLeavesNoFile) {
  const mpf::test::TemporaryFolder files;
  const CapsuleStore store(files.path());
  static_cast<void>(::signal(SIGXFSZ, SIG_IGN));
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit little{10, before.rlim_max};  // bytes of each file, as on a full disk
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &little), 0);

  EXPECT_THROW(store.add(kCapsule), std::system_error);

  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  EXPECT_TRUE(std::filesystem::is_empty(files.path()));
}

TEST(CapsuleStore, ThatCannotBeReadIsNotEmpty) {
  const mpf::test::TemporaryFolder folder;
  const CapsuleStore store(folder.write("file", ""));

  EXPECT_THROW(static_cast<void>(store.list()), std::system_error);
}

}  // namespace
}  // namespace mpf::crate::test
