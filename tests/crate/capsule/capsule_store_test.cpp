// SPDX-License-Identifier: MIT
// CapsuleStore: limits by number and size, and rights.
#include "crate/capsule/capsule_store.h"

#include <sys/stat.h>

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace mpf::crate::test
