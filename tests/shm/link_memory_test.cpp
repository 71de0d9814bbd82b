// SPDX-License-Identifier: MIT
// The memory of a link: its rings, and the second ring of replies, which gets memory when the
// client needs it.
#include <sys/stat.h>

#include <algorithm>

#include "tests/shm/endpoint_pair.h"
#include "tests/shm/shm_fixture.h"

namespace mpf::test {
namespace {

class LinkMemoryTest : public ShmTest {
 protected:
  Connected makeLink(std::uint32_t queueSize) {
    client_.reset();
    server_.emplace(backplane_, "server", WaitMode::block, Offer{.queueSize = queueSize});
    client_.emplace(backplane_, "", WaitMode::block);
    return connect(*client_, *server_);
  }
  void TearDown() override {
    client_.reset();
    server_.reset();
    ShmTest::TearDown();
  }
  static LinkSend send(Link& link, std::size_t bytes, std::uint32_t reserve = 0) {
    const std::vector<std::byte> body(bytes);
    return link.trySend({.requestId = 1}, body, {0, reserve});
  }
  static void take(Link& link) {
    ASSERT_TRUE(link.incoming().hasMessage());
    static_cast<void>(link.incoming().begin());
    link.incoming().end();
  }

  std::optional<End> server_;
  std::optional<End> client_;
};

// The first ring of replies, and the second one, have room for the first replies to all requests
// that may be unanswered, beside further replies, and slots that the client has not freed yet.
TEST(LinkGeometry, HasRoomForTheFirstRepliesToAllRequestsThatMayBeUnanswered) {
  const auto notFreed = [](std::uint32_t slots) { return slots / kFreeFraction - 1; };
  for (std::uint32_t queueSize = 1; queueSize <= LinkGeometry::kMaxQueueSize; ++queueSize) {
    const auto geometry = LinkGeometry::forQueue(queueSize);
    const auto further = std::max(16u, queueSize / 8);
    ASSERT_GE(geometry.queueSlots, queueSize + notFreed(geometry.queueSlots));
    ASSERT_GE(geometry.firstOutstanding, 1u);
    ASSERT_EQ(geometry.maxOutstanding, 2 * queueSize);
    const bool hasSecond = geometry.moreReplySlots != 0;
    ASSERT_GE(geometry.replySlots - (hasSecond ? 1 : 0),
              geometry.firstOutstanding + further + notFreed(geometry.replySlots))
        << queueSize;
    if (!hasSecond) continue;
    ASSERT_GE(geometry.moreReplySlots,
              geometry.maxOutstanding + further + notFreed(geometry.moreReplySlots))
        << queueSize;
  }
}

std::uint64_t memoryOf(const std::string& segment) {
  struct stat file{};
  EXPECT_EQ(::stat(segments::path(segment).c_str(), &file), 0);
  return static_cast<std::uint64_t>(file.st_blocks) * 512;
}

TEST_F(LinkMemoryTest, HasMemoryForMoreRepliesWhenItsClientAllowsThem) {
  const auto link = makeLink(100);
  EXPECT_EQ(memoryOf(link.client.name()), 16u << 10);
  EXPECT_EQ(link.client.maxOutstanding(), 16u);
  EXPECT_EQ(link.server.maxOutstanding(), 16u);

  ASSERT_TRUE(link.client.tryAllowMore());

  EXPECT_EQ(memoryOf(link.client.name()), 32u << 10);
  EXPECT_EQ(link.client.maxOutstanding(), 200u);
  EXPECT_EQ(link.server.maxOutstanding(), 200u);
  EXPECT_TRUE(link.client.tryAllowMore()) << "changes nothing";
}

// Without its name, a file cannot get memory.
TEST_F(LinkMemoryTest, AllowsNoMoreWithoutMemory) {
  const auto link = makeLink(100);
  segments::remove(link.client.name());

  EXPECT_FALSE(link.client.tryAllowMore());

  EXPECT_EQ(link.server.maxOutstanding(), 16u);
}

// The server sends further replies until it may send no more, and then all first replies.
TEST_F(LinkMemoryTest, FirstRepliesAlwaysHaveRoom) {
  enum class Allows { never, beforeFurtherReplies, afterThem };
  for (const std::uint32_t queueSize : {1u, 5u, 20u, 21u, 47u, 48u, 100u, 103u, 1000u}) {
    for (const auto allows : {Allows::never, Allows::beforeFurtherReplies, Allows::afterThem}) {
      for (const auto sizes : {1u, 100u}) {  // bodies of 0, and of 0 to 99 bytes
        for (const std::uint32_t takenBefore : {0u, 5u, 63u}) {
          const auto link = makeLink(queueSize);
          std::uint32_t sent = 0;
          for (; sent < takenBefore; ++sent) {
            ASSERT_EQ(send(link.server, 8), LinkSend::sent);
            take(link.client);
          }
          ASSERT_TRUE(allows != Allows::beforeFurtherReplies || link.client.tryAllowMore());
          const auto further = [&] {
            return send(link.server, sent % sizes, link.server.slotsOfFirstReplies());
          };
          while (further() == LinkSend::sent) ++sent;
          ASSERT_TRUE(allows != Allows::afterThem || link.client.tryAllowMore());

          for (std::uint32_t i = 0; i < link.client.maxOutstanding(); ++i, ++sent)
            ASSERT_EQ(send(link.server, 8), LinkSend::sent) << queueSize << " " << i;

          for (; sent > takenBefore; --sent) take(link.client);
          EXPECT_FALSE(link.client.incoming().hasMessage());
        }
      }
    }
  }
}

}  // namespace
}  // namespace mpf::test
