// SPDX-License-Identifier: MIT
// SegmentImage: copies of segments, and errors for files that are not segments.
#include "tools/inspect/segment_image.h"

#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include <mpf/message_server.h>

#include "shm/process.h"
#include "tests/shm/shm_fixture.h"

namespace mpf::tools {
namespace {

using test::whatOf;

class SegmentImageTest : public test::ShmTest {
 protected:
  [[nodiscard]] std::string path() const { return segments::path(serverName()); }
  void write(const std::string& bytes) const { std::ofstream(path(), std::ios::binary) << bytes; }
  [[nodiscard]] std::optional<SegmentImage> read() const {
    return SegmentImage::tryRead(serverName(), layout::SegmentKind::serverWindow,
                                 layout::kWindowBytes);
  }
  // The error when the file is read; removes the file.
  [[nodiscard]] std::string refusal() const {
    const auto why = whatOf<std::exception>([&] { static_cast<void>(read()); });
    std::filesystem::remove(path());
    return why;
  }
};

TEST_F(SegmentImageTest, AMissingSegmentIsNotAnError) { EXPECT_FALSE(read()); }

TEST_F(SegmentImageTest, ContainsWhatTheOwnerWrote) {
  const MessageServer server(backplane_, "server", {.location = 0, .queueSize = 7});

  const auto image = read();

  ASSERT_TRUE(image);
  EXPECT_STREQ(image->header().name.data(), "server");
  EXPECT_EQ(image->header().ownerPid, ::getpid());
  EXPECT_EQ(image->window().queueSize.load(std::memory_order_relaxed), 7U);
  EXPECT_EQ(image->fileBytes(), std::filesystem::file_size(path()));
}

// The copy does not change when the segment is changed or removed.
TEST_F(SegmentImageTest, StaysWhenTheSegmentIsRemoved) {
  auto server = std::make_unique<MessageServer>(backplane_, "server",
                                                ServerOptions{.location = 0, .queueSize = 7});
  const auto image = read();

  server.reset();

  EXPECT_EQ(image->window().queueSize.load(std::memory_order_relaxed), 7U);
  EXPECT_FALSE(read());
}

// Other versions may have shorter windows: the missing bytes are zero.
TEST_F(SegmentImageTest, BytesBehindTheEndOfTheFileAreZero) {
  auto segment =
      Segment::create(layout::kHeaderBytes, layout::SegmentKind::serverWindow, name(), {});
  ASSERT_TRUE(segment.tryPublish(serverName()));

  const auto image = read();

  ASSERT_TRUE(image);
  EXPECT_EQ(image->window().received.load(std::memory_order_relaxed), 0U);
  segments::remove(serverName());
}

TEST_F(SegmentImageTest, RefusesFilesThatAreNotSegments) {
  write("");
  EXPECT_EQ(refusal(), path() + ": truncated, 0 bytes are too few for a header");
  write(std::string(511, 'x'));
  EXPECT_EQ(refusal(), path() + ": truncated, 511 bytes are too few for a header");
  write(std::string(4096, 'x'));
  EXPECT_EQ(refusal(), path() + ": not a segment of MPF (wrong magic number)");
}

TEST_F(SegmentImageTest, RefusesDirectoriesAndPipesWithoutWaiting) {
  ASSERT_EQ(::mkfifo(path().c_str(), 0600), 0);
  EXPECT_EQ(refusal(), path() + ": not a segment of MPF (not a regular file)");
  std::filesystem::create_directory(path());
  EXPECT_EQ(refusal(), path() + ": not a segment of MPF (not a regular file)");
  std::filesystem::create_symlink("/dev/zero", path());
  EXPECT_THAT(refusal(), testing::StartsWith("open " + path()));
}

TEST_F(SegmentImageTest, RefusesSegmentsOfAnotherKind) {
  auto pendingBind = createPage(layout::SegmentKind::pendingBind);
  ASSERT_TRUE(pendingBind.tryPublish(serverName()));

  EXPECT_EQ(refusal(), path() + ": a segment of kind 6, expected kind 1");
}

TEST_F(SegmentImageTest, RefusesTruncatedSegments) {
  auto window = createPage(layout::SegmentKind::serverWindow);
  ASSERT_TRUE(window.tryPublish(serverName()));
  ASSERT_EQ(::truncate(path().c_str(), 600), 0);

  EXPECT_EQ(refusal(), path() + ": truncated, 600 bytes of 4096");
}

}  // namespace
}  // namespace mpf::tools
