// SPDX-License-Identifier: MIT
// FrameReader: frames in parts of any size, and invalid bytes.
#include "router/transport/frame_reader.h"

#include <algorithm>
#include <cstring>
#include <gmock/gmock.h>

#include "tests/router/frames.h"

namespace mpf::test {
namespace {

using router::FarewellCode;
using router::FrameReader;
using router::ProtocolError;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr std::uint64_t kLimit = std::uint64_t{64} << 20;

// Feeds bytes to a FrameReader and records the stamps of the pings that it reads.
class Reading {
 public:
  explicit Reading(std::uint64_t limit = kLimit) : reader_(limit) {}

  void feed(std::span<const std::uint8_t> bytes) {
    while (!bytes.empty()) {
      auto room = reader_.room();
      EXPECT_NE(room.size(), 0u);
      const auto part = bytes.first(std::min(room.size(), bytes.size()));
      std::memcpy(room.begin(), part.data(), part.size());
      reader_.filled(part.size());
      bytes = bytes.subspan(part.size());
      while (auto* frame = reader_.tryNext()) {
        ++frames_;
        for (const auto item : frame->getRoot<wire::Frame>().getItems())
          stamps_.push_back(item.getPing().getStamp());
      }
    }
  }
  // Returns the code with which these bytes are refused.
  FarewellCode refusal(std::span<const std::uint8_t> bytes) try {
    feed(bytes);
    ADD_FAILURE() << "the bytes were accepted";
    return {};
  } catch (const ProtocolError& error) {
    return error.code();
  }
  FrameReader& reader() { return reader_; }
  [[nodiscard]] const std::vector<std::uint64_t>& stamps() const { return stamps_; }
  [[nodiscard]] int frames() const { return frames_; }

 private:
  FrameReader reader_;
  std::vector<std::uint64_t> stamps_;
  int frames_ = 0;
};

// A segment table without its segments.
Bytes tableOf(const std::vector<std::uint32_t>& segmentWords) {
  std::vector<std::uint32_t> table{static_cast<std::uint32_t>(segmentWords.size() - 1)};
  table.insert(table.end(), segmentWords.begin(), segmentWords.end());
  if (table.size() % 2 != 0) table.push_back(0);
  Bytes bytes;
  for (const auto number : table) {
    for (int shift = 0; shift < 32; shift += 8)
      bytes.push_back(static_cast<std::uint8_t>(number >> shift));
  }
  return bytes;
}

TEST(FrameReader, ReadsFramesCutIntoThreePartsAtAnyByte) {
  const auto bytes =
      joined({frameOf({ping(1)}), frameOf({ping(2), ping(3)}), frameOf({}), frameOf({ping(4)})});
  const std::span all(bytes);

  for (std::size_t first = 0; first <= bytes.size(); ++first) {
    for (auto second = first; second <= bytes.size(); ++second) {
      Reading reading;
      reading.feed(all.first(first));
      reading.feed(all.subspan(first, second - first));
      reading.feed(all.subspan(second));
      ASSERT_THAT(reading.stamps(), ElementsAre(1, 2, 3, 4))
          << "cut at " << first << " and " << second;
      ASSERT_EQ(reading.frames(), 4);
    }
  }
}

TEST(FrameReader, ReadsALongFrameByteByByte) {
  std::vector<Fill> items;
  std::vector<std::uint64_t> stamps;
  for (std::uint64_t stamp = 0; stamp < 10'000; ++stamp) {
    items.push_back(ping(stamp));
    stamps.push_back(stamp);
  }
  const auto bytes = frameOf(items);
  ASSERT_GT(bytes.size(), std::size_t{128} << 10);
  Reading reading;

  for (const auto& byte : bytes) reading.feed({&byte, 1});

  EXPECT_EQ(reading.stamps(), stamps);
  EXPECT_EQ(reading.reader().pending(), 0u);
}

TEST(FrameReader, ReadsFramesOfSeveralSegments) {
  Reading reading;
  const auto bytes = frameOf({ping(1), ping(2), ping(3)}, 8);
  ASSERT_GT(bytes[0], 1) << "segments";

  reading.feed(bytes);

  EXPECT_THAT(reading.stamps(), ElementsAre(1, 2, 3));
}

TEST(FrameReader, RefusesTooManySegments) {
  Reading reading;

  std::vector<std::uint32_t> words(FrameReader::kMaxSegments);
  words.front() = 1;  // a zero word: a frame without items

  reading.feed(joined({tableOf(words), Bytes(8)}));

  EXPECT_EQ(reading.frames(), 1);
  EXPECT_EQ(Reading().refusal(tableOf(std::vector<std::uint32_t>(FrameReader::kMaxSegments + 1))),
            FarewellCode::PROTOCOL);
  EXPECT_EQ(Reading().refusal(Bytes(8, 0xff)), FarewellCode::PROTOCOL);
}

TEST(FrameReader, RefusesTooManyBytes) {
  const auto bytes = frameOf({ping(1)});

  Reading exact(bytes.size());
  exact.feed(bytes);

  EXPECT_THAT(exact.stamps(), ElementsAre(1));
  EXPECT_EQ(Reading(bytes.size() - 1).refusal(bytes), FarewellCode::LIMIT);
  EXPECT_EQ(Reading().refusal(tableOf({0xffff'ffff})), FarewellCode::LIMIT);
  EXPECT_EQ(Reading().refusal(tableOf(std::vector<std::uint32_t>(512, 0xffff'ffff))),
            FarewellCode::LIMIT);
}

// It does not wait for the rest of the frame.
TEST(FrameReader, RefusesALongFrameByItsSegmentTable) {
  EXPECT_EQ(Reading(1024).refusal(tableOf({128})), FarewellCode::LIMIT);
}

TEST(FrameReader, AppliesANewLimitToTheNextFrame) {
  const auto bytes = frameOf({ping(1)});
  Reading reading(bytes.size());
  reading.feed(bytes);

  reading.reader().setMaxFrameBytes(bytes.size() - 1);

  EXPECT_EQ(reading.refusal(bytes), FarewellCode::LIMIT);
}

TEST(FrameReader, AllocatesForReceivedAndNotForAnnouncedBytes) {
  constexpr std::size_t kFirst = std::size_t{64} << 10;
  Reading reading;
  auto& reader = reading.reader();
  reading.feed(tableOf({(60u << 20) / 8}));

  while (reader.pending() < std::size_t{32} << 20) {
    auto room = reader.room();
    ASSERT_LE(room.size() + reader.pending(),
              std::max(kFirst, 2 * reader.pending() + (std::size_t{4} << 10)));
    reading.feed(Bytes(std::min(room.size(), std::size_t{100'000})));
  }
}

TEST(FrameReader, FreesTheMemoryOfALongFrame) {
  capnp::MallocMessageBuilder message;
  message.initRoot<wire::Frame>().initItems(1)[0].initFarewell().initReason(16u << 20);
  Reading reading;

  const auto frame = bytesOf(message);
  const std::span all(frame);
  reading.feed(all.first(all.size() - 1));
  static_cast<void>(reading.reader().tryNext());
  auto room = reading.reader().room();
  room[0] = all.back();
  reading.reader().filled(1);
  ASSERT_NE(reading.reader().tryNext(), nullptr);

  EXPECT_LE(reading.reader().room().size(), std::size_t{64} << 10);
  reading.feed(frameOf({ping(1)}));
  EXPECT_THAT(reading.stamps(), ElementsAre(1));
}

// A thousand items point to the same text of 100 kB, so that a reader might copy 100 MB.
TEST(FrameReader, LimitsHowOftenTheSameBytesAreRead) {
  constexpr capnp::uint kItems = 1000;
  capnp::MallocMessageBuilder message(1u << 20);
  auto items = message.initRoot<wire::Frame>().initItems(kItems);
  items[0].initFarewell().initReason(100'000);
  auto bytes = bytesOf(message);
  // Each item has two words, the second of which is a struct pointer. Its offset counts from the
  // word after the pointer.
  constexpr std::size_t kFirstItem = 8 + 3 * 8;
  std::uint64_t pointer = 0;
  std::memcpy(&pointer, &bytes[kFirstItem + 8], sizeof pointer);
  const auto offset = static_cast<std::uint32_t>(pointer) >> 2;
  for (capnp::uint at = 1; at < kItems; ++at) {
    const auto item = kFirstItem + 16 * at;
    std::memcpy(&bytes[item], &bytes[kFirstItem], 8);
    const auto moved = (pointer & 0xffff'ffff'0000'0000) | std::uint64_t{offset - 2 * at} << 2;
    std::memcpy(&bytes[item + 8], &moved, sizeof moved);
  }
  FrameReader reader(kLimit);
  for (std::span<const std::uint8_t> rest(bytes); !rest.empty();) {
    auto room = reader.room();
    const auto part = rest.first(std::min(room.size(), rest.size()));
    std::memcpy(room.begin(), part.data(), part.size());
    reader.filled(part.size());
    rest = rest.subspan(part.size());
  }

  auto* frame = reader.tryNext();

  ASSERT_NE(frame, nullptr);
  std::size_t read = 0;
  EXPECT_THROW(for (const auto item : frame->getRoot<wire::Frame>().getItems()) read +=
               item.getFarewell().getReason().size(),
               kj::Exception);
  EXPECT_LT(read, 8 * bytes.size());
}

}  // namespace
}  // namespace mpf::test
