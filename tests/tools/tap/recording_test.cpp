// SPDX-License-Identifier: MIT
// Recording: written, read, cut off and damaged.
#include "tools/tap/recording.h"

#include <sys/stat.h>

#include <capnp/message.h>
#include <cstring>
#include <filesystem>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace mpf::tools {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class RecordingTest : public testing::Test {
 protected:
  // Writes records with these totals of missed messages, and with a text of this length.
  void write(std::initializer_list<std::uint64_t> totals, std::size_t textBytes = 0) const {
    RecordingWriter writer(path_);
    for (const auto total : totals) {
      capnp::MallocMessageBuilder builder;
      auto record = builder.initRoot<wire::Record>();
      record.setLink(total);
      if (textBytes == 0) record.setMissed(total);
      else record.initUnreadable().setProblem(std::string(textBytes, 'x'));
      writer.write(builder);
    }
    writer.close();
  }
  // The links of all records up to the end or the first error, which `error_` then contains.
  std::vector<std::uint64_t> read() {
    std::vector<std::uint64_t> links;
    error_.clear();
    try {
      RecordingReader reader(path_);
      while (
          reader.tryNext([&](wire::Record::Reader record) { links.push_back(record.getLink()); })) {
      }
      place_ = reader.place();
    } catch (const std::runtime_error& error) {
      error_ = error.what();
    }
    return links;
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("x.mpf");
  std::string error_;
  std::string place_;
};

TEST_F(RecordingTest, IsReadInTheOrderInWhichItWasWritten) {
  write({7, 8, 9});

  EXPECT_THAT(read(), ElementsAre(7, 8, 9));
  EXPECT_EQ(error_, "");
  const auto bytes = std::filesystem::file_size(path_);
  EXPECT_EQ(place_, path_ + ": record 3, at byte " + std::to_string(bytes / 3 * 2) + " of " +
                        std::to_string(bytes));
}

TEST_F(RecordingTest, MayBeEmpty) {
  write({});

  EXPECT_THAT(read(), testing::IsEmpty());
  EXPECT_EQ(error_, "");
}

// A record may be larger than the buffer of the reader, and than the default limit of Cap'n Proto.
TEST_F(RecordingTest, HasRecordsOfAnySize) {
  write({7}, 70 << 20);

  EXPECT_THAT(read(), ElementsAre(7));
  EXPECT_EQ(error_, "");
}

// It may contain confidential messages: only its owner may read it.
TEST_F(RecordingTest, IsReadableByItsOwnerOnly) {
  write({7});

  struct stat status{};
  ASSERT_EQ(::stat(path_.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0600U);
}

TEST_F(RecordingTest, IsReadUpToTheRecordThatIsCutOff) {
  write({7, 8, 9});
  const auto bytes = std::filesystem::file_size(path_);
  const auto record = bytes / 3;
  for (const auto cut : {bytes - 1, bytes - 8, 2 * record + 1}) {
    std::filesystem::resize_file(path_, cut);

    EXPECT_THAT(read(), ElementsAre(7, 8));
    EXPECT_EQ(error_, path_ + ": record 3, at byte " + std::to_string(2 * record) + " of " +
                          std::to_string(cut) +
                          ": the file is damaged, or was cut off here; the records before it can "
                          "be read: `head -c " +
                          std::to_string(2 * record) +
                          " FILE >NEW` keeps them, `mpf tap --write` records again");
  }

  std::filesystem::resize_file(path_, 2 * record);
  EXPECT_THAT(read(), ElementsAre(7, 8));
  EXPECT_EQ(error_, "") << "the file ends behind a record";

  std::filesystem::resize_file(path_, record + 5);
  EXPECT_THAT(read(), ElementsAre(7));
  EXPECT_THAT(error_, HasSubstr("the record before it can be read"));
}

TEST_F(RecordingTest, RefusesAFileThatIsNotARecording) {
  for (const auto* text : {"x", "text, in which the number of segments of the first is large",
                           "\xff\xff\xff\xff\xff\xff\xff\xff"}) {
    folder_.write("x.mpf", text);

    EXPECT_THAT(read(), testing::IsEmpty());
    EXPECT_EQ(error_, path_ + ": record 1, at byte 0 of " + std::to_string(std::strlen(text)) +
                          ": not a recording of `mpf tap --write`, or one that was cut off within "
                          "its first record");
  }
}

// The text of a record is longer than the file: nothing of that size is allocated.
TEST_F(RecordingTest, RefusesARecordThatIsLargerThanTheFile) {
  const std::string huge("\x00\x00\x00\x00\xff\xff\xff\x1f", 8);  // one segment of 4 GiB
  folder_.write("x.mpf", huge + std::string(64, '\0'));

  EXPECT_THAT(read(), testing::IsEmpty());
  EXPECT_THAT(error_, HasSubstr("not a recording"));
}

TEST_F(RecordingTest, NamesTheFileThatCannotBeOpened) {
  const auto errorOf = [](auto act) -> std::string {
    try {
      act();
      return {};
    } catch (const std::system_error& error) {
      return error.what();
    }
  };
  const auto missing = folder_.file("none/x.mpf");

  EXPECT_EQ(errorOf([&] { const RecordingReader reader(missing); }),
            "open " + missing + ": No such file or directory");
  EXPECT_EQ(errorOf([&] { const RecordingWriter writer(missing); }),
            "open " + missing + ": No such file or directory");
  EXPECT_EQ(errorOf([&] { const RecordingWriter writer("/dev/full"); }),
            "write /dev/full: No space left on device");
}

}  // namespace
}  // namespace mpf::tools
