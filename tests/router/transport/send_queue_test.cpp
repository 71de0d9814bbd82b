// SPDX-License-Identifier: MIT
// SendQueue: which items share a frame, limits, and the requests that were never sent.
#include "router/transport/send_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>
#include <vector>

#include <mpf/message_of.h>

#include "router/transport/kj_text.h"

namespace mpf::router::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using Origin = SendQueue::Origin;

class SendQueueTest : public testing::Test {
 public:
  ~SendQueueTest() noexcept override = default;

 protected:
  static constexpr std::uint32_t kQueueSize = 3;

  // Builds frames, and returns their items as text.
  std::vector<std::string> frames(std::size_t items = SIZE_MAX) {
    queue_.buildFrames(
        {.items = items, .bytes = 4096, .messageBytes = 1000},
        [&](const Carried& carried, const std::string& why, wire::Item::Builder instead) {
          unsendable_.push_back(std::to_string(carried.requestId) + ": " + why);
          instead.setClose(99);
        });
    std::vector<std::string> texts;
    kj::Vector<kj::byte> bytes;
    partBytes_.clear();
    for (auto part = queue_.part(); part.size() != 0; part = queue_.part()) {
      const auto before = bytes.size();
      for (const auto piece : part) bytes.addAll(piece);
      partBytes_.push_back(bytes.size() - before);
      queue_.partWritten(partBytes_.back());
    }
    kj::ArrayInputStream stream(bytes);
    while (stream.tryGetReadBuffer().size() != 0) {
      capnp::InputStreamMessageReader frame(stream);
      for (const auto item : frame.getRoot<wire::Frame>().getItems())
        texts.push_back(toStd(kj::str(item)));
    }
    return texts;
  }
  static SendQueue::FillItem close(std::uint32_t number) {
    return [number](wire::Item::Builder item) { item.setClose(number); };
  }
  static Carried request(std::uint32_t id) {
    return {.isRequest = true, .client = 1, .requestId = id, .message = Int32Message({.value = 0})};
  }
  static Carried array(std::uint32_t id, std::size_t bytes) {
    auto message =
        Char8ArrayMessage::inBuffer(allocateHeapBody(Char8ArrayMessage::bytesFor(bytes)), bytes);
    return {.isRequest = true, .client = 1, .requestId = id, .message = std::move(message)};
  }

  static PlainItem plain(std::uint32_t id, bool isRequest = true) {
    return {.isRequest = isRequest,
            .isFirst = !isRequest,
            .client = 1,
            .requestId = id,
            .message = Int32Message({.value = 5})};
  }

  layout::RouterLine row_{};
  PeerRecord record_{row_};
  SendQueue queue_{kQueueSize, record_};
  std::vector<std::string> unsendable_;
  std::vector<std::size_t> partBytes_;  // of the last frames
};

TEST_F(SendQueueTest, PutsAllThatWaitsIntoOneFrameInItsOrder) {
  queue_.push(close(1), Origin::own);
  queue_.push(request(2));
  queue_.push(close(3), Origin::answer);

  EXPECT_THAT(frames(), ElementsAre("(close = 1)", HasSubstr("requestId = 2"), "(close = 3)"));
  EXPECT_TRUE(queue_.isEmpty());
  EXPECT_EQ(row_.messagesSent, 1u);
  EXPECT_EQ(row_.framesSent, 1u);
  EXPECT_GT(row_.bytesSent, 0u);
}

TEST_F(SendQueueTest, KeepsTheOrderOfPlainItemsAndOthers) {
  queue_.push(plain(1));
  queue_.push(plain(2));
  queue_.push(request(3));
  queue_.push(plain(4));

  EXPECT_THAT(frames(), ElementsAre(HasSubstr("requestId = 1"), HasSubstr("requestId = 2"),
                                    HasSubstr("requestId = 3"), HasSubstr("requestId = 4")));
  EXPECT_EQ(row_.messagesSent, 4u);
  EXPECT_EQ(row_.framesSent, 3u);
  EXPECT_EQ(row_.inQueue, 0u);
}

TEST_F(SendQueueTest, SendsItemsThatCameTogether) {
  MessageRun run(MessageType::int32);
  for (const std::uint32_t id : {2u, 3u}) {
    run.add(EnvelopeWords::of({.requestId = id, .clientType = 7, .clientExtra = 8, .timeNs = 9}, 1,
                              layout::kFirstSlotBodyBytes));
    run.add(FirstBody{id, 0, 0});
  }
  queue_.push(plain(1, false));
  queue_.push(router::PlainItems{false, true, 1, run});
  EXPECT_EQ(row_.inQueue, 3u);
  EXPECT_EQ(queue_.room(), kQueueSize - 3);

  EXPECT_THAT(frames(), ElementsAre(HasSubstr("requestId = 1, "),
                                    AllOf(HasSubstr("requestId = 2, isFirst = true"),
                                          HasSubstr("clientType = 7, clientExtra = 8, "),
                                          HasSubstr("timeStampNs = 9")),
                                    HasSubstr("requestId = 3, ")));
  EXPECT_EQ(row_.messagesSent, 3u);
}

TEST_F(SendQueueTest, ARepliesMissedMessagesAreSentWithIt) {
  auto reply = plain(1, false);
  reply.message.setRoute({0, 0, Message::missedFlags(7), nullptr});
  queue_.push(reply);
  queue_.push(Carried{.client = 1, .requestId = 1, .message = std::move(reply.message)});

  EXPECT_THAT(frames(), ElementsAre(HasSubstr("missed = 7"), HasSubstr("missed = 7")));
}

TEST_F(SendQueueTest, AWriteHasOneFrameOfOtherItems) {
  queue_.push(close(1), Origin::own);
  queue_.push(plain(2));
  queue_.push(close(3), Origin::own);

  EXPECT_THAT(frames(), ElementsAre("(close = 1)", HasSubstr("requestId = 2")));
  EXPECT_THAT(frames(), ElementsAre("(close = 3)"));
}

TEST_F(SendQueueTest, DividesALongRunOfPlainItems) {
  constexpr std::uint32_t kItems = 10'000;
  for (std::uint32_t id = 1; id <= kItems; ++id) queue_.push(plain(id));

  std::vector<std::string> all;
  while (!queue_.isEmpty()) {
    const auto some = frames();
    EXPECT_LE(row_.bytesSent / row_.framesSent, PlainRun::kMaxBytes);
    all.insert(all.end(), some.begin(), some.end());
  }

  ASSERT_THAT(all, SizeIs(kItems));
  for (std::uint32_t id = 1; id <= kItems; ++id)
    ASSERT_THAT(all[id - 1], HasSubstr("requestId = " + std::to_string(id) + ","));
}

TEST_F(SendQueueTest, DividesLongFramesIntoParts) {
  constexpr auto kPart = SendQueue::kPartBytes;
  queue_.push(plain(1));
  queue_.push([](auto item) { item.initFarewell().setReason(std::string(2 * kPart, 'x')); },
              Origin::own);

  const auto items = frames();

  ASSERT_EQ(items.size(), 2u);
  EXPECT_THAT(items[0], HasSubstr("requestId = 1, "));
  EXPECT_GT(items[1].size(), 2 * kPart);
  EXPECT_THAT(partBytes_, ElementsAre(kPart, kPart, testing::Lt(1024u)));
}

// The memory of a run is used again.
TEST_F(SendQueueTest, RunsDoNotMix) {
  for (std::uint32_t round = 1; round <= 10; ++round) {
    queue_.push(plain(2 * round));
    queue_.push(plain(2 * round + 1, false));

    EXPECT_THAT(frames(), ElementsAre(HasSubstr("request = "), HasSubstr("reply = ")));
  }
}

TEST_F(SendQueueTest, IsBeingWrittenUntilItsFramesAre) {
  queue_.push(close(1), Origin::own);
  EXPECT_FALSE(queue_.isBeingWritten());

  frames();
  EXPECT_TRUE(queue_.isBeingWritten());
  queue_.framesWritten();

  EXPECT_FALSE(queue_.isBeingWritten());
}

TEST_F(SendQueueTest, AFrameIsLimitedInItemsAndBytes) {
  for (std::uint32_t id = 1; id <= 6; ++id) queue_.push(array(id, 900));

  EXPECT_THAT(frames(1), SizeIs(1));
  EXPECT_THAT(frames(), SizeIs(3)) << "4096 bytes";
  EXPECT_THAT(frames(), SizeIs(2));
}

// One frame after the other uses the same memory, which must be zero at the start.
TEST_F(SendQueueTest, FramesDoNotMix) {
  queue_.push(array(1, 900));
  frames();
  queue_.push(close(2), Origin::own);

  EXPECT_THAT(frames(), ElementsAre("(close = 2)"));
}

TEST_F(SendQueueTest, HasNoRoomWhileTooManyMessagesWait) {
  for (std::uint32_t id = 1; id <= kQueueSize; ++id) {
    EXPECT_TRUE(queue_.hasRoom());
    if (id % 2 == 0) queue_.push(plain(id));
    else queue_.push(request(id));
  }
  EXPECT_FALSE(queue_.hasRoom());
  EXPECT_EQ(row_.inQueue, kQueueSize);

  frames(1);

  EXPECT_TRUE(queue_.hasRoom());
  EXPECT_EQ(row_.inQueue, kQueueSize - 1);
}

TEST_F(SendQueueTest, HasNoRoomWhileTooManyNotesWait) {
  for (std::size_t i = 1; i < SendQueue::kMaxControlItems; ++i) queue_.push(close(1), Origin::own);
  EXPECT_TRUE(queue_.hasRoom());

  queue_.push(close(1), Origin::own);

  EXPECT_FALSE(queue_.hasRoom());
  EXPECT_FALSE(queue_.hasMaxAnswers());
}

TEST_F(SendQueueTest, CountsAnswersUntilTheyAreInAFrame) {
  for (std::size_t i = 0; i < SendQueue::kMaxControlItems; ++i)
    queue_.push(close(1), Origin::answer);
  EXPECT_TRUE(queue_.hasMaxAnswers());

  frames(1);

  EXPECT_FALSE(queue_.hasMaxAnswers());
}

TEST_F(SendQueueTest, ReportsAMessageThatCannotBeSentAndSendsAnotherItem) {
  queue_.push(array(7, 1001));
  queue_.push(request(8));

  EXPECT_THAT(frames(), ElementsAre("(close = 99)", HasSubstr("requestId = 8")));
  EXPECT_THAT(unsendable_, ElementsAre(HasSubstr("7: ")));
}

TEST_F(SendQueueTest, ReturnsTheRequestsThatAreInNoFrame) {
  queue_.push(request(1));
  frames();
  queue_.push(request(2));
  queue_.push(close(1), Origin::own);
  queue_.push(Carried{.requestId = 3, .message = Int32Message({.value = 0})});  // a reply
  queue_.reject(request(4));
  queue_.reject(Carried{.requestId = 5, .message = Int32Message({.value = 0})});
  queue_.push(plain(6));
  queue_.push(plain(7, false));
  queue_.reject(plain(8));
  queue_.reject(plain(9, false));

  const auto unsent = queue_.takeUnsentRequests();

  std::vector<std::uint32_t> ids;
  for (const auto& request : unsent) {
    EXPECT_EQ(request.client, 1u);
    ids.push_back(request.requestId);
  }
  EXPECT_THAT(ids, ElementsAre(2, 6, 4, 8));
  EXPECT_TRUE(queue_.isEmpty());
  EXPECT_THAT(queue_.takeUnsentRequests(), IsEmpty());
}

}  // namespace
}  // namespace mpf::router::test
