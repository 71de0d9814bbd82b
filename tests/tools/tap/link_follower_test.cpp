// SPDX-License-Identifier: MIT
// LinkFollower: the messages of a server and a client of this thread.
#include "tools/tap/link_follower.h"

#include <cstring>

#include "tests/tools/one_link.h"

namespace mpf::tools {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;
using testing::StartsWith;

class LinkFollowerTest : public test::OneLinkTest {
 protected:
  void follow(FollowFrom from) {
    follower_ = LinkFollower::tryOpen(name(), linkName(), from);
    ASSERT_TRUE(follower_);
  }
  std::vector<TappedMessage> takeAll() {
    std::vector<TappedMessage> all;
    while (follower_->take(all)) continue;
    return all;
  }
  // Of the only link, for writing.
  layout::LinkControl& control() {
    link_.emplace(openForWriting(linkName(), layout::SegmentKind::link));
    return link_->at<layout::LinkControl>(layout::kLinkControlOffset);
  }
  void exchangeMoreThanTheRingsHold() {
    const int before = taken_;
    for (int i = 1; i <= kMessages; ++i) {
      sendValue(i);
      handle(1);
      takeReplies(before + i);
    }
  }
  // Direction, number and value of each message: "-> 2: 5", "<- 2: 6".
  static std::vector<std::string> texts(const std::vector<TappedMessage>& all) {
    std::vector<std::string> made;
    for (const auto& each : all) {
      made.push_back((each.direction == Direction::request ? "-> " : "<- ") +
                     std::to_string(each.requestId) + ": " +
                     std::to_string(each.message.tryAs<Int32>()->value));
    }
    return made;
  }

  static constexpr int kMessages = 500;  // more than the rings hold
  std::unique_ptr<LinkFollower> follower_;
  std::optional<Segment> link_;
};

TEST_F(LinkFollowerTest, ALinkThatDoesNotExistIsNotAnError) {
  EXPECT_EQ(LinkFollower::tryOpen(name(), SegmentName::link(name(), 1, 2), FollowFrom::first),
            nullptr);
}

TEST_F(LinkFollowerTest, RefusesRingsThatDoNotFitTheFile) {
  const auto refused = SegmentName::link(name(), 1, 2);
  for (const std::uint32_t slots : {0U, 8U, 17U, 1U << 31, 1U << 12}) {
    auto segment = createPage(layout::SegmentKind::link);
    segment.sharedHeader().queueSlots = 16;
    segment.sharedHeader().replySlots = slots;
    ASSERT_TRUE(segment.tryPublish(refused));

    EXPECT_EQ(test::whatOf<SegmentError>([&] {
                static_cast<void>(LinkFollower::tryOpen(name(), refused, FollowFrom::first));
              }),
              segments::path(refused) + ": not a link: its rings do not fit its file")
        << slots;

    segments::remove(refused);
  }
}

TEST_F(LinkFollowerTest, PutsEachReplyBehindItsRequest) {
  connect();
  follow(FollowFrom::newest);
  for (int value = 10; value < 15; ++value) sendValue(value);
  handle(2);

  EXPECT_THAT(texts(takeAll()), ElementsAre("-> 1: 10", "<- 1: 11", "-> 2: 11", "<- 2: 12",
                                            "-> 3: 12", "-> 4: 13", "-> 5: 14"));
  EXPECT_THAT(takeAll(), IsEmpty());

  handle(1);
  EXPECT_THAT(texts(takeAll()), ElementsAre("<- 3: 13")) << "its request has been read";
  EXPECT_EQ(follower_->missed(), 0U);
}

TEST_F(LinkFollowerTest, BeginsWithTheFirstOrBehindTheNewestMessage) {
  connect();
  sendValue(1);
  handle(1);

  follow(FollowFrom::newest);
  EXPECT_THAT(takeAll(), IsEmpty());
  follow(FollowFrom::first);
  EXPECT_THAT(texts(takeAll()), ElementsAre("-> 1: 1", "<- 1: 2"));
}

// A producer may be interrupted between a message and its count.
TEST_F(LinkFollowerTest, AMessageThatIsCountedLateIsNotMissed) {
  connect();
  sendValue(1);
  auto& counter = control().clientSent;
  counter.store(0);
  follow(FollowFrom::newest);
  EXPECT_THAT(takeAll(), IsEmpty());

  counter.store(1);

  EXPECT_THAT(takeAll(), IsEmpty());
  EXPECT_EQ(follower_->missed(), 0U);
}

TEST_F(LinkFollowerTest, HasTheRouteOfAMessage) {
  connect();
  follow(FollowFrom::newest);
  auto request = Int32Message({.value = 1});
  request.setClientType(4);
  request.setClientExtra(5);
  ASSERT_EQ(client_->send(std::move(request)), SendResult::sent);
  handle(1);

  const auto all = takeAll();

  ASSERT_THAT(all, SizeIs(2));
  for (const auto& each : all) {
    EXPECT_EQ(each.message.getClientType(), 4);
    EXPECT_EQ(each.message.getClientExtra(), 5);
  }
  EXPECT_FALSE(all[0].isFirstReply);
  EXPECT_TRUE(all[1].isFirstReply);
}

// Once the server has taken a message, it may write to the chunk.
TEST_F(LinkFollowerTest, ReadsBodiesInPoolsAndMarksThoseThatMayHaveChanged) {
  connect();
  follow(FollowFrom::newest);
  sendArray(1.5);

  const auto early = takeAll();
  ASSERT_THAT(early, SizeIs(1));
  EXPECT_EQ(early[0].message.valueAs<Float64Array>()[0], 1.5);
  EXPECT_FALSE(early[0].mayHaveChanged);

  sendArray(2.5);
  handle(2);
  const auto late = takeAll();
  ASSERT_THAT(late, SizeIs(3));
  EXPECT_EQ(late[1].direction, Direction::request);
  EXPECT_TRUE(late[1].mayHaveChanged);
  EXPECT_EQ(late[0].direction, Direction::reply);
  EXPECT_FALSE(late[0].mayHaveChanged) << "the client has not taken it";
}

TEST_F(LinkFollowerTest, SaysWhyABodyCannotBeRead) {
  connect();
  follow(FollowFrom::newest);
  sendArray(1.5);
  const auto link = openForWriting(linkName(), layout::SegmentKind::link);
  layout::ChunkRef ref{.segment = 0, .chunk = 0, .side = 3, .missed = 0};
  std::memcpy((&link.at<layout::Slot>(layout::kLinkRingsOffset))->body.data(), &ref, sizeof ref);

  const auto all = takeAll();

  ASSERT_THAT(all, SizeIs(1));
  EXPECT_FALSE(all[0].message);
  EXPECT_EQ(all[0].problem,
            "a chunk of side 3; the sides of a link are 0 and 1, the fan-out pool is 2");
}

// Every message that was sent is either seen or missed.
TEST_F(LinkFollowerTest, CountsTheMessagesThatItMissed) {
  connect();
  follow(FollowFrom::newest);
  exchangeMoreThanTheRingsHold();

  const auto seen = takeAll().size();

  EXPECT_GT(follower_->missed(), 0U);
  EXPECT_EQ(seen + follower_->missed(), 2U * kMessages);
}

TEST_F(LinkFollowerTest, CountsTheSameAfterAMessageThatIsCountedLate) {
  connect();
  sendValue(1);
  handle(1);
  takeReplies(1);
  control().clientSent.store(0);
  control().serverSent.store(0);
  follow(FollowFrom::newest);
  exchangeMoreThanTheRingsHold();

  const auto seen = takeAll().size();

  EXPECT_EQ(seen + follower_->missed(), 2U * kMessages);
}

TEST_F(LinkFollowerTest, IsOverWhenASideHasClosedTheLinkAndReadsTheRest) {
  connect();
  follow(FollowFrom::newest);
  sendValue(1);
  EXPECT_FALSE(follower_->isOver());

  client_.reset();

  EXPECT_TRUE(follower_->isOver());
  EXPECT_THAT(texts(takeAll()), ElementsAre("-> 1: 1"));
}

}  // namespace
}  // namespace mpf::tools
