// SPDX-License-Identifier: MIT
#include <mpf/serial_sniff.h>

#include <array>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace mpf::test {
namespace {

using namespace serial;
using testing::ElementsAre;
using testing::Eq;
using testing::Optional;

using Bytes = std::array<char, SniffRecord::kBytes>;

Char8ArrayMessage replyOf(std::span<const SniffRecord> records) {
  auto reply = Char8ArrayMessage::allocValue(records.size() * SniffRecord::kBytes);
  reply->extra = static_cast<std::int32_t>(records.size());
  for (std::size_t i = 0; i < records.size(); ++i) {
    records[i].write(reply.value().subspan(i * SniffRecord::kBytes).first<SniffRecord::kBytes>());
  }
  return reply;
}

TEST(SniffRecord, IsTenBytesWithTheTimeFirst) {
  Bytes bytes{};

  SniffRecord{0x0102030405060708, SniffKind::received, 0xfe}.write(bytes);

  EXPECT_THAT(bytes, ElementsAre(8, 7, 6, 5, 4, 3, 2, 1, 'R', static_cast<char>(0xfe)));
}

TEST(SniffRecord, ReadsWhatItWrote) {
  for (const auto kind :
       {SniffKind::sent, SniffKind::received, SniffKind::damaged, SniffKind::breakSignal}) {
    const SniffRecord record{-0x0102030405060708, kind, 0x80};
    Bytes bytes{};

    record.write(bytes);

    EXPECT_THAT(SniffRecord::tryRead(bytes), Optional(record));
  }
}

TEST(SniffRecord, RefusesAnUnknownKind) {
  const Bytes bytes{8, 7, 6, 5, 4, 3, 2, 1, 'x', 0};

  EXPECT_THAT(SniffRecord::tryRead(bytes), Eq(std::nullopt));
}

TEST(SniffReply, ReturnsItsRecordsInOrder) {
  const std::array records{SniffRecord{1, SniffKind::sent, 'a'},
                           SniffRecord{2, SniffKind::damaged, 'b'}};

  EXPECT_THAT(tryReadRecords(replyOf(records)), Optional(ElementsAre(records[0], records[1])));
}

TEST(SniffReply, RefusesACountThatDiffersFromItsRecords) {
  const std::array records{SniffRecord{1, SniffKind::sent, 'a'},
                           SniffRecord{2, SniffKind::sent, 'b'}};
  for (const auto count : {-1, 1, 3}) {
    auto reply = replyOf(records);

    reply->extra = count;

    EXPECT_THAT(tryReadRecords(reply), Eq(std::nullopt)) << count;
  }
}

TEST(SniffReply, RefusesAnIncompleteRecord) {
  const std::array records{SniffRecord{1, SniffKind::sent, 'a'},
                           SniffRecord{2, SniffKind::sent, 'b'}};
  auto reply = replyOf(records);
  reply->extra = 1;

  reply.setSize(SniffRecord::kBytes + 1);

  EXPECT_THAT(tryReadRecords(reply), Eq(std::nullopt));
}

TEST(SniffReply, RefusesARecordOfAnUnknownKind) {
  const std::array records{SniffRecord{1, SniffKind::sent, 'a'}};
  auto reply = replyOf(records);

  reply.value()[8] = 'x';

  EXPECT_THAT(tryReadRecords(reply), Eq(std::nullopt));
}

}  // namespace
}  // namespace mpf::test
