// SPDX-License-Identifier: MIT
#include "shm/mapping.h"

#include <fcntl.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <system_error>
#include <utility>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"
#include "tests/support/temporary_folder.h"

namespace mpf::test {
namespace {

constexpr std::size_t kMappedBytes = 4096;

class MappingTest : public testing::Test {
 protected:
  void SetUp() override { checkCall(::ftruncate(file_.get(), kMappedBytes), "ftruncate"); }

  TemporaryFolder folder_;
  FileDescriptor file_{
      checkCall(::open(folder_.file("f").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600), "open")};
};

TEST_F(MappingTest, SharesTheBytesOfTheFileAfterTheFileIsClosed) {
  const Mapping writer(file_.get(), kMappedBytes, Mapping::Access::readWrite);
  const Mapping reader(file_.get(), kMappedBytes, Mapping::Access::readOnly);
  file_.reset();

  writer.data()[17] = std::byte{42};

  EXPECT_EQ(reader.data()[17], std::byte{42});
  EXPECT_EQ(reader.bytes(), kMappedBytes);
  EXPECT_FALSE(reader.isLost());
}

TEST_F(MappingTest, IsEmptyWithoutAFile) {
  const Mapping mapping;

  EXPECT_EQ(mapping.bytes(), 0U);
  EXPECT_FALSE(mapping.isLost());
}

TEST_F(MappingTest, MovesTheMemoryAndItsGuard) {
  Mapping first(file_.get(), kMappedBytes, Mapping::Access::readWrite);
  auto* const data = first.data();

  Mapping second(std::move(first));
  Mapping third(file_.get(), kMappedBytes, Mapping::Access::readOnly);
  third = std::move(second);

  EXPECT_EQ(third.data(), data);
  checkCall(::ftruncate(file_.get(), 0), "ftruncate");
  EXPECT_EQ(third.data()[0], std::byte{0}) << "the guard still covers it";
  EXPECT_TRUE(third.isLost());
}

TEST_F(MappingTest, ReportsWhatCannotBeMapped) {
  try {
    const Mapping mapping(-1, kMappedBytes, Mapping::Access::readOnly);
    ADD_FAILURE() << "no exception";
  } catch (const std::system_error& error) {
    EXPECT_EQ(error.code().value(), EBADF);
    EXPECT_THAT(error.what(), testing::HasSubstr("map 4096 bytes of a segment"));
  }
}

}  // namespace
}  // namespace mpf::test
