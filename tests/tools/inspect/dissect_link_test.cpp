// SPDX-License-Identifier: MIT
// Dissection of a link: its messages, and invalid contents.
#include "tools/inspect/dissect_link.h"

#include <cstring>
#include <filesystem>
#include <fmt/format.h>

#include "tests/tools/one_link.h"

namespace mpf::tools {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class DissectLinkTest : public test::OneLinkTest {
 protected:
  [[nodiscard]] Tree dissect(const DissectOptions& options = {}) const {
    return tryDissect(segments::path(linkName()), options).value_or(Tree());
  }
  [[nodiscard]] Segment openLink() const {
    return openForWriting(linkName(), layout::SegmentKind::link);
  }
  // The first slot of the request ring.
  static layout::Slot& firstSlot(const Segment& link) {
    return link.at<layout::Slot>(layout::kLinkRingsOffset);
  }
  // The problem of the first request.
  [[nodiscard]] std::string problem() const {
    return dissect().at("requests").at("messages").at(0).at("problem").get<std::string>();
  }
  [[nodiscard]] std::string bulkPath() const {
    return segments::path(SegmentName::bulk(name(), incarnation(), 0, 0));
  }
  [[nodiscard]] std::uint64_t incarnation() const {
    return SegmentName::tryParse(linkName())->incarnation;
  }
};

TEST_F(DissectLinkTest, HasBothSidesAndTheirLimits) {
  connect(20);

  const auto link = dissect();

  EXPECT_EQ(link.at("kind"), "link");
  EXPECT_EQ(link.at("server"), "dac");
  EXPECT_EQ(link.at("location"), 2);
  EXPECT_EQ(link.at("server_side").at("state"), "open");
  EXPECT_EQ(link.at("client_side").at("state"), "open");
  EXPECT_EQ(link.at("client_side").at("sent"), 0);
  EXPECT_EQ(link.at("limits").at("queue_size"), 20);
  EXPECT_EQ(link.at("requests").at("messages"), Tree::array());
  EXPECT_EQ(link.at("client_pool").at("segments"), Tree::array());
}

TEST_F(DissectLinkTest, HasTheLastMessagesOfBothRings) {
  connect();
  for (const int value : {5, 6, 7}) sendValue(value);
  handle(2);

  const auto link = dissect({.last = 2});

  EXPECT_EQ(link.at("client_side").at("unanswered"), 3);
  EXPECT_EQ(link.at("requests").at("sent"), 3);
  EXPECT_EQ(link.at("requests").at("taken"), 2);
  EXPECT_EQ(link.at("requests").at("waiting"), 1);
  const auto& requests = link.at("requests").at("messages");
  ASSERT_EQ(requests.size(), 2U);
  EXPECT_EQ(requests.at(0).at("request_id"), 2);
  EXPECT_EQ(requests.at(0).at("first_reply"), false);
  EXPECT_EQ(requests.at(1).at("state"), "waiting");
  EXPECT_EQ(requests.at(1).at("text"), "int32 timeout=0 cmd=0 status=0 address=7 extra=0 value=7");
  EXPECT_EQ(requests.at(1).at("message").at("value"), 7);
  const auto& replies = link.at("replies").at("messages");
  ASSERT_EQ(replies.size(), 2U);
  EXPECT_EQ(replies.at(0).at("request_id"), 1);
  EXPECT_EQ(replies.at(0).at("first_reply"), true);
  EXPECT_EQ(replies.at(0).at("message").at("value"), 6);
}

// Replies that the client has not taken: some in the first ring, the others in the second one.
TEST_F(DissectLinkTest, HasTheRepliesOfBothRingsInOneRow) {
  connect(100);
  constexpr int kReplies = 80;
  for (int value = 0; value < kReplies; ++value) sendValue(value);
  handle(kReplies);
  ASSERT_NE(openLink().at<layout::LinkControl>(layout::kLinkControlOffset).repliesMoved, 0u);

  const auto link = dissect({.last = 1000});

  EXPECT_EQ(link.at("replies").at("waiting"), kReplies);
  const auto& replies = link.at("replies").at("messages");
  ASSERT_EQ(replies.size(), static_cast<std::size_t>(kReplies));
  for (int value = 0; value < kReplies; ++value) {
    const auto& reply = replies.at(static_cast<std::size_t>(value));
    EXPECT_EQ(reply.at("state"), "waiting");
    EXPECT_EQ(reply.at("message").at("value"), value + 1);
  }
  takeReplies(kReplies);
  EXPECT_EQ(dissect().at("replies").at("waiting"), 0);
}

TEST_F(DissectLinkTest, ReadsABodyFromItsPool) {
  connect();
  sendArray(1.5);

  const auto link = dissect();

  const auto& request = link.at("requests").at("messages").at(0);
  EXPECT_EQ(request.at("chunk"), (Tree{{"side", 0}, {"segment", 0}, {"chunk", 0}}));
  EXPECT_EQ(request.at("message").at("value").at(0), 1.5);
  ASSERT_EQ(link.at("client_pool").at("segments").size(), 1U);
  EXPECT_EQ(link.at("client_pool").at("segments").at(0).at("file"), bulkPath());
  EXPECT_EQ(link.at("server_pool").at("segments"), Tree::array());
}

TEST_F(DissectLinkTest, ReadsABodyFromTheFanOutPoolOfItsServer) {
  connect();
  Int32Message kept;
  server_->on<Int32>([&](Int32Message&& request) { kept = std::move(request); });
  sendValue(5);
  handle(1);
  auto message = server_->allocShared<Float64Array>(1000);
  message.value()[0] = 2.5;
  ASSERT_EQ(server_->publish(message, kept), ReplyResult::sent);

  const auto link = dissect();

  const auto& reply = link.at("replies").at("messages").at(0);
  EXPECT_EQ(reply.at("chunk"), (Tree{{"side", 2}, {"segment", 0}, {"chunk", 0}}));
  EXPECT_EQ(reply.at("missed"), 0);
  EXPECT_EQ(reply.at("message").at("value").at(0), 2.5);
}

TEST_F(DissectLinkTest, SaysWhyABodyCannotBeRead) {
  connect();
  sendArray(1.5);
  const auto link = openLink();
  auto& slot = firstSlot(link);
  const auto bodyBytes = slot.bodyBytes;
  const auto chunks = dissect().at("client_pool").at("segments").at(0).at("chunk_count");
  const auto refer = [&](layout::ChunkRef ref) { std::memcpy(slot.body.data(), &ref, sizeof ref); };

  refer({.segment = 0, .chunk = chunks, .side = 0, .missed = 0});
  EXPECT_EQ(problem(), bulkPath() + ": has no chunk " + chunks.dump() + " of " +
                           std::to_string(bodyBytes) + " bytes");
  refer({.segment = 0, .chunk = 0, .side = 3, .missed = 0});
  EXPECT_EQ(problem(), "a chunk of side 3; the sides of a link are 0 and 1, the fan-out pool is 2");
  refer({.segment = 1, .chunk = 0, .side = 1, .missed = 0});
  EXPECT_THAT(problem(), testing::EndsWith(".1.1: the file does not exist"));
  refer({.segment = 0, .chunk = 0, .side = 0, .missed = 0});
  slot.bodyBytes = UINT32_MAX;
  EXPECT_THAT(problem(), StartsWith(bulkPath() + ": has no chunk 0 of 4294967295 bytes"));
  slot.bodyBytes = bodyBytes;
  EXPECT_EQ(dissect().at("requests").at("messages").at(0).at("message").at("value").at(0), 1.5);
}

TEST_F(DissectLinkTest, SaysThatAPoolIsTooShort) {
  connect();
  sendArray(1.5);
  const auto bulk =
      openForWriting(SegmentName::bulk(name(), incarnation(), 0, 0), layout::SegmentKind::bulk);
  bulk.sharedHeader().chunkCount = 1'000'001;
  const layout::ChunkRef ref{.segment = 0, .chunk = 1'000'000, .side = 0, .missed = 0};
  std::memcpy(firstSlot(openLink()).body.data(), &ref, sizeof ref);
  EXPECT_EQ(problem(), bulkPath() + ": chunk 1000000 is cut off");

  std::filesystem::resize_file(bulkPath(), layout::kBulkChunksOffset + 100);
  EXPECT_THAT(problem(), StartsWith(bulkPath() + ": truncated, 4196 bytes of "));
}

TEST_F(DissectLinkTest, AnInlineBodyLongerThanItsSlotsIsAProblem) {
  connect();
  sendValue(5);
  firstSlot(openLink()).bodyBytes = 1000;

  EXPECT_EQ(problem(), "1000 bytes of body in 1 slots");
}

TEST_F(DissectLinkTest, ABodyThatDoesNotFitItsTypeIsShownAsInvalid) {
  connect();
  sendValue(5);
  firstSlot(openLink()).bodyBytes = 3;

  const auto message = dissect().at("requests").at("messages").at(0);

  EXPECT_THAT(message.dump(), HasSubstr("int32"));
  EXPECT_FALSE(message.contains("problem"));
}

TEST_F(DissectLinkTest, RingsThatAreImpossibleAreAProblem) {
  connect();
  const auto link = openLink();
  auto& header = link.sharedHeader();
  const auto slots = header.queueSlots;

  header.queueSlots = slots + 1;
  EXPECT_EQ(dissect().at("problem"),
            fmt::format("rings of {}, {} and {} slots do not fit a file of {} bytes", slots + 1,
                        header.replySlots, header.moreReplySlots, header.totalBytes));
  EXPECT_FALSE(dissect().contains("requests"));
  header.queueSlots = layout::kMaxRingSlots;
  EXPECT_THAT(dissect().at("problem").get<std::string>(), HasSubstr(" do not fit a file of "));
  header.queueSlots = slots;
  header.backplane = {'.', '.', '/', 'x'};
  EXPECT_THAT(dissect().at("problem").get<std::string>(), HasSubstr("\"../x\""));
}

// The bytes of the slots are shown with the messages; the rest of the segment once.
TEST_F(DissectLinkTest, RawBytesAreThoseBeforeTheRingsAndOfEachMessage) {
  connect();
  sendValue(5);

  const auto link = dissect({.raw = true});

  EXPECT_EQ(link.at("raw").get<std::string>().size(), 2 * layout::kLinkRingsOffset);
  const auto& message = link.at("requests").at("messages").at(0);
  EXPECT_EQ(message.at("raw").get<std::string>().size(), 2 * sizeof(layout::Slot));
  EXPECT_THAT(message.at("raw").get<std::string>(), StartsWith("0100000000000000"))
      << "the sequence of the first message";
}

TEST(HexDigits, AreTwoForEachByte) {
  const std::array bytes{std::byte{0}, std::byte{0x0f}, std::byte{0xff}};

  EXPECT_EQ(hexDigits(bytes), "000fff");
  EXPECT_EQ(hexDigits({}), "");
}

}  // namespace
}  // namespace mpf::tools
