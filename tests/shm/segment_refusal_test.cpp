// SPDX-License-Identifier: MIT
// Files that have the name of a segment but are not usable: each is refused with a message that
// names the file and the reason.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/shm/child.h"
#include "tests/shm/shm_fixture.h"
#include "tests/support/random.h"

namespace mpf::test {
namespace {

using layout::SegmentHeader;
using layout::SegmentKind;
using testing::AllOf;
using testing::HasSubstr;
using Access = Segment::Access;

class SegmentRefusal : public ShmTest {
 protected:
  void SetUp() override { ASSERT_TRUE(segment_.tryPublish(file_)); }
  void TearDown() override {
    ::unlink(path_.c_str());
    ShmTest::TearDown();
  }
  // The error with which the segment is refused; empty if it can be opened.
  [[nodiscard]] std::string refusal(SegmentKind kind = SegmentKind::pendingBind) const {
    return whatOf<SegmentError>(
        [&] { static_cast<void>(Segment::tryOpen(file_, kind, Access::readOnly)); });
  }
  [[nodiscard]] SegmentHeader& header() const { return segment_.sharedHeader(); }

  static constexpr uid_t kNobody = 65534;
  std::string file_ = SegmentName::keyed(name(), NameKind::pendingBind, 1);
  std::string path_ = segments::path(file_);
  Segment segment_ = createPage();
};

TEST_F(SegmentRefusal, AcceptsAGoodSegment) { EXPECT_EQ(refusal(), ""); }

TEST_F(SegmentRefusal, NamesAForeignFile) {
  header().magic ^= 1;

  EXPECT_THAT(refusal(), AllOf(HasSubstr(path_), HasSubstr("wrong magic number")));
}

TEST_F(SegmentRefusal, NamesASegmentOfTheOtherByteOrder) {
  header().magic = __builtin_bswap64(header().magic);

  EXPECT_THAT(refusal(), AllOf(HasSubstr(path_), HasSubstr("wrong magic number")));
}

TEST_F(SegmentRefusal, NamesBothVersions) {
  header().layoutMajor = 3;
  EXPECT_THAT(refusal(),
              AllOf(HasSubstr(path_), HasSubstr("layout version 3; this program supports 1;")));

  header().layoutMajor = 0;
  EXPECT_THAT(refusal(), HasSubstr("layout version 0; this program supports"));
}

TEST_F(SegmentRefusal, AcceptsANewerMinorVersion) {
  header().layoutMinor = layout::kMinor + 1;

  EXPECT_EQ(refusal(), "");
}

TEST_F(SegmentRefusal, NamesBothKinds) {
  EXPECT_THAT(refusal(SegmentKind::link),
              AllOf(HasSubstr(path_), HasSubstr("of kind 6, expected kind 4")));
}

TEST_F(SegmentRefusal, NamesBothLengthsOfATruncatedFile) {
  ASSERT_EQ(::truncate(path_.c_str(), 4095), 0);
  EXPECT_THAT(refusal(), AllOf(HasSubstr(path_), HasSubstr("truncated, 4095 bytes of 4096")));

  ASSERT_EQ(::truncate(path_.c_str(), layout::kHeaderBytes - 1), 0);
  EXPECT_THAT(refusal(), AllOf(HasSubstr(path_), HasSubstr("511 bytes are too few")));

  ASSERT_EQ(::truncate(path_.c_str(), 0), 0);
  EXPECT_THAT(refusal(), AllOf(HasSubstr(path_), HasSubstr("0 bytes are too few")));
}

TEST_F(SegmentRefusal, RefusesAnImpossibleLength) {
  header().totalBytes = layout::kHeaderBytes - 1;
  EXPECT_THAT(refusal(), HasSubstr("truncated, 4096 bytes of 511"));

  header().totalBytes = UINT64_MAX;
  EXPECT_THAT(refusal(), HasSubstr("truncated"));
}

TEST_F(SegmentRefusal, AcceptsAFileThatIsLongerThanItsHeaderSays) {
  ASSERT_EQ(::truncate(path_.c_str(), 8192), 0);

  EXPECT_EQ(refusal(), "");
}

TEST_F(SegmentRefusal, DoesNotFollowASymbolicLink) {
  ASSERT_EQ(::unlink(path_.c_str()), 0);
  ASSERT_EQ(::symlink("/etc/hostname", path_.c_str()), 0);

  EXPECT_THAT(
      whatOf<std::system_error>([&] {
        static_cast<void>(Segment::tryOpen(file_, SegmentKind::pendingBind, Access::readOnly));
      }),
      HasSubstr("open " + path_));
  EXPECT_FALSE(segments::removeIfOwnerless(file_));
}

// Any user may create files in /dev/shm. Opening a FIFO for reading would wait for a writer.
TEST_F(SegmentRefusal, DoesNotBlockOnAFifo) {
  ASSERT_EQ(::unlink(path_.c_str()), 0);
  ASSERT_EQ(::mkfifo(path_.c_str(), 0600), 0);

  EXPECT_THAT(refusal(), HasSubstr(path_));
  EXPECT_NE(segments::probeOwner(file_, 1), segments::Owner::dead);
}

TEST_F(SegmentRefusal, NamesADirectory) {
  ASSERT_EQ(::unlink(path_.c_str()), 0);
  ASSERT_EQ(::mkdir(path_.c_str(), 0700), 0);

  EXPECT_THAT(refusal(), HasSubstr(path_));

  ASSERT_EQ(::rmdir(path_.c_str()), 0);
}

TEST_F(SegmentRefusal, NamesAFileWithoutPermission) {
  ASSERT_EQ(::chmod(path_.c_str(), 0), 0);
  Child stranger([&](Child::Self& self) {
    if (::getuid() == 0) checkCall(::setuid(kNobody), "setuid");
    self.ready();
    const auto why = whatOf<std::system_error>([&] {
      static_cast<void>(Segment::tryOpen(file_, SegmentKind::pendingBind, Access::readOnly));
    });
    // A file that we may not open must not be declared dead.
    const bool isLeftAlone = segments::probeOwner(file_) == segments::Owner::alive &&
                             !segments::removeIfOwnerless(file_);
    ::_exit(why.starts_with("open " + path_) && isLeftAlone ? 0 : 1);
  });

  stranger.go();

  EXPECT_EQ(stranger.end(0), 0);
}

TEST_F(SegmentRefusal, RefusesARandomHeaderOrCanUseIt) {
  Random random;
  const auto good = header();

  for (int i = 0; i < 20'000; ++i) {
    header() = good;
    auto* bytes = reinterpret_cast<std::byte*>(&header());
    for (auto changes = 1 + random.below(3); changes != 0; --changes)
      bytes[random.below(40)] = static_cast<std::byte>(random.bits());
    const auto why = refusal();
    if (why.empty()) {
      ASSERT_EQ(header().magic, good.magic);
      ASSERT_EQ(header().kind, good.kind);
      ASSERT_LE(header().totalBytes, layout::kPageBytes);
    } else {
      ASSERT_THAT(why, HasSubstr(path_));
    }
  }
}

}  // namespace
}  // namespace mpf::test
