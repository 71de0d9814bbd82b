// SPDX-License-Identifier: MIT
// Host: properties from files of a temporary folder.
#include "tools/doctor/host.h"

#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace mpf::tools {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class HostTest : public testing::Test {
 protected:
  HostTest() { host_.root = folder_.path(); }
  void write(const std::string& path, const std::string& text) const {
    std::filesystem::create_directories((host_.root / path).parent_path());
    std::ofstream(host_.root / path) << text;
  }

  test::TemporaryFolder folder_;
  Host host_;
};

TEST_F(HostTest, ReadsAFileWithoutTrailingWhiteSpace) {
  write("proc/version", " 6.1 \n two \n\n");
  write("proc/empty", "\n");

  EXPECT_EQ(host_.tryRead("proc/version"), " 6.1 \n two");
  EXPECT_THAT(host_.tryReadLines("proc/version"), ElementsAre(" 6.1 ", " two"));
  EXPECT_EQ(host_.tryRead("proc/empty"), "");
  EXPECT_THAT(host_.tryReadLines("proc/empty"), IsEmpty());
}

TEST_F(HostTest, AFileThatIsAbsentIsNotAnError) {
  EXPECT_EQ(host_.tryRead("none"), std::nullopt);
  EXPECT_EQ(host_.tryRead("."), std::nullopt) << "a folder";
  EXPECT_THAT(host_.tryReadLines("none"), IsEmpty());
  EXPECT_THAT(host_.list("none"), IsEmpty());
  EXPECT_EQ(host_.number("none"), std::nullopt);
  EXPECT_EQ(host_.mountAt("/proc").has_value(), false);
  EXPECT_EQ(host_.ofProcess("Uid"), std::nullopt);
  EXPECT_EQ(host_.limit("Max open files"), std::nullopt);
}

TEST_F(HostTest, ListsTheNamesOfAFolderInOrder) {
  for (const auto* each : {"b", "a", "c/d"}) write(std::string("dev/shm/") + each, "");

  EXPECT_THAT(host_.list("dev/shm"), ElementsAre("a", "b", "c"));
}

TEST_F(HostTest, ANumberIsTheWholeText) {
  for (const auto& [text, number] :
       std::vector<std::pair<std::string, std::optional<std::uint64_t>>>{
           {"65530\n", 65530},
           {"0", 0},
           {"18446744073709551615", UINT64_MAX},
           {"18446744073709551616", std::nullopt},
           {"-1", std::nullopt},
           {"12 files", std::nullopt},
           {" 12", std::nullopt},
           {"", std::nullopt}}) {
    write("number", text);

    EXPECT_EQ(host_.number("number"), number) << text;
  }
}

// A file system that was mounted later hides the earlier one.
TEST_F(HostTest, TheLastMountIsTheVisibleOne) {
  write("proc/self/mounts",
        "tmpfs /dev/shm tmpfs rw,size=65536k,mode=1777 0 0\n"
        "tmpfs /dev/shm/sub tmpfs rw 0 0\n"
        "overlay /dev/shm overlay ro,lowerdir=a=b 0 0\n"
        "cut /dev/shm\n");

  const auto mount = host_.mountAt("/dev/shm");

  ASSERT_TRUE(mount);
  EXPECT_EQ(mount->type, "overlay");
  EXPECT_THAT(mount->options,
              ElementsAre(testing::Pair("lowerdir", "a=b"), testing::Pair("ro", "")));
  EXPECT_FALSE(host_.mountAt("/dev"));
}

TEST_F(HostTest, APropertyOfTheProcessIsTheRestOfItsLine) {
  write("proc/self/status", "Name:\tmpf\nUid:\t1 2 3 4\nGroups:\t \nUidMap:\t9\n");

  EXPECT_EQ(host_.ofProcess("Uid"), "1 2 3 4");
  EXPECT_EQ(host_.ofProcess("Groups"), "");
  EXPECT_EQ(host_.ofProcess("Gid"), std::nullopt);
}

TEST_F(HostTest, ALimitIsTheSoftOne) {
  write("proc/self/limits",
        "Limit                     Soft Limit           Hard Limit           Units     \n"
        "Max open files            1024                 524288               files     \n"
        "Max address space         unlimited            unlimited            bytes     \n"
        "Max stack size            large                unlimited            bytes     \n");

  EXPECT_EQ(host_.limit("Max open files"), 1024U);
  EXPECT_EQ(host_.limit("Max address space"), UINT64_MAX);
  EXPECT_EQ(host_.limit("Max stack size"), std::nullopt);
  EXPECT_EQ(host_.limit("Max open"), std::nullopt);
}

TEST(HostHere, HasSharedMemory) {
  const auto space = Host::spaceOfSharedMemory();

  ASSERT_TRUE(space);
  EXPECT_GT(space->totalBytes, 0U);
  EXPECT_LE(space->freeBytes, space->totalBytes);
  EXPECT_LE(space->freeFiles, space->totalFiles);
}

TEST(BytesText, HasTheLargestUnitThatFits) {
  EXPECT_EQ(bytesText(0), "0 B");
  EXPECT_EQ(bytesText(1023), "1023 B");
  EXPECT_EQ(bytesText(1024), "1.0 KiB");
  EXPECT_EQ(bytesText(64 << 20), "64.0 MiB");
  EXPECT_EQ(bytesText(std::uint64_t{3} << 29), "1.5 GiB");
  EXPECT_EQ(bytesText(std::uint64_t{1} << 52), "4096.0 TiB");
}

}  // namespace
}  // namespace mpf::tools
