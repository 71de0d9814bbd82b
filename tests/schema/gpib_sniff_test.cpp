// SPDX-License-Identifier: MIT
#include <mpf/gpib_sniff.h>

#include <array>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace mpf::test {
namespace {

using GpibRecord = gpib::SniffRecord;
using testing::ElementsAre;
using testing::Eq;
using testing::Optional;

using GpibRecordBytes = std::array<char, GpibRecord::kBytes>;

TEST(GpibSniffRecord, IsTenBytesWithTheTimeFirst) {
  GpibRecordBytes bytes{};

  GpibRecord{0x0102030405060708, GpibRecord::kReceived | GpibRecord::kEnd, 0xfe}.write(bytes);

  EXPECT_THAT(bytes, ElementsAre(8, 7, 6, 5, 4, 3, 2, 1, 5, static_cast<char>(0xfe)));
}

TEST(GpibSniffRecord, ReadsWhatItWroteAndRefusesUnknownFlags) {
  for (std::uint8_t flags = 0; flags < 16; ++flags) {
    const GpibRecord record{-5, flags, 0x3f};
    GpibRecordBytes bytes{};
    record.write(bytes);

    const auto read = GpibRecord::tryRead(bytes);

    EXPECT_EQ(read, flags < 8 ? std::optional(record) : std::nullopt) << int{flags};
  }
}

TEST(GpibSniffReply, ReturnsItsRecordsAndRefusesAWrongCount) {
  const GpibRecord record{7, GpibRecord::kAttention, '?'};
  auto reply = Char8ArrayMessage::allocValue(GpibRecord::kBytes);
  record.write(reply.value().first<GpibRecord::kBytes>());

  reply->extra = 1;
  EXPECT_THAT(gpib::tryReadRecords(reply), Optional(ElementsAre(record)));
  reply->extra = 2;
  EXPECT_THAT(gpib::tryReadRecords(reply), Eq(std::nullopt));
}

}  // namespace
}  // namespace mpf::test
