// SPDX-License-Identifier: MIT
// MessageLink: messages of each size cross a link, and each body returns to its owner once.
#include "shm/messages/message_link.h"

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <gtest/gtest.h>
#include <memory>
#include <optional>

#include <mpf/message_of.h>

#include "shm/segment.h"
#include "tests/shm/endpoint_pair.h"
#include "tests/shm/shm_fixture.h"

namespace mpf::test {
namespace {

class MessageLinkTest : public ShmTest {
 protected:
  MessageLinkTest() {
    const auto connected = connect(*clientEnd_, *serverEnd_);
    client_ = makeLink(*clientEnd_, connected.clientIndex);
    server_ = makeLink(*serverEnd_, connected.serverIndex);
  }
  static std::shared_ptr<MessageLink> makeLink(End& end, std::uint32_t index) {
    end.endpoint.detach(index);
    return MessageLink::make(std::move(end.links[index]), std::make_shared<BiasedLock>());
  }
  // An array whose elements are their indices, in the memory that the client's link chooses.
  Int32ArrayMessage allocate(std::size_t n) {
    const auto bytes = Int32ArrayMessage::bytesFor(n);
    auto body = tryAllocate(bytes);
    auto message =
        Int32ArrayMessage::inBuffer(body.data != nullptr ? body : allocateHeapBody(bytes), n);
    std::int32_t next = 0;
    for (auto& element : message.value()) element = next++;
    return message;
  }
  BodyBytes tryAllocate(std::size_t bytes) {
    const BiasedLock::Guard guard(client_->lock());
    return client_->tryAllocateLocked(bytes);
  }
  LinkSend send(Message& message) {
    Envelope envelope{.type = static_cast<std::uint16_t>(message.getType()),
                      .clientType = message.getClientType()};
    const BiasedLock::Guard guard(client_->lock());
    return client_->trySendLocked(client_->link(), [&] { return envelope; }, message, {});
  }
  // The next message that the server receives; an empty handle if it is invalid.
  Message take() {
    Envelope envelope;
    EXPECT_TRUE(server_->hasMessage() && server_->tryBegin(envelope));
    if (MessageLink::isShort(envelope.body())) return server_->finishShort(envelope, {}, 0);
    const auto marks = envelope.marks();
    return server_->finishLong(envelope.body(), {{}, marks.clientType(), marks.clientExtra(), 0},
                               finish_);
  }
  // The slot of the first request.
  layout::Slot& firstSlot() {
    auto* const segment =
        reinterpret_cast<std::byte*>(&server_->link().control()) - layout::kLinkControlOffset;
    return *reinterpret_cast<layout::Slot*>(segment + layout::kLinkRingsOffset);
  }
  void TearDown() override {
    client_.reset();
    server_.reset();
    clientEnd_.reset();
    serverEnd_.reset();
    ShmTest::TearDown();
  }

  std::optional<End> serverEnd_{std::in_place, backplane_, "server"};
  std::optional<End> clientEnd_{std::in_place, backplane_, ""};
  std::shared_ptr<MessageLink> client_;
  std::shared_ptr<MessageLink> server_;
  MessageLink::Finish finish_{};
};

class ArrayLengths : public MessageLinkTest, public testing::WithParamInterface<std::size_t> {};

TEST_P(ArrayLengths, Cross) {
  auto sent = allocate(GetParam());
  sent.setClientType(9);
  ASSERT_TRUE(send(sent) == LinkSend::sent || !sent);

  const auto received = Int32ArrayMessage::tryFrom(take());

  ASSERT_TRUE(received);
  EXPECT_EQ(received->getClientType(), 9);
  ASSERT_EQ(received->getLength(), GetParam());
  std::int32_t next = 0;
  EXPECT_TRUE(std::ranges::all_of(received->value(), [&](auto value) { return value == next++; }));
}
// In the first slot, in the handle, in several slots, in a chunk.
INSTANTIATE_TEST_SUITE_P(OfEachKind, ArrayLengths, testing::Values(0, 2, 40, 10'000));

TEST_F(MessageLinkTest, TheCmdOfALongRequestIsInItsSlot) {
  for (const std::size_t length : {40u, 10'000u}) {  // in several slots, in a chunk
    auto request = allocate(length);
    request->cmd = -7;
    ASSERT_TRUE(send(request) == LinkSend::sent || !request);

    Envelope envelope;
    ASSERT_TRUE(server_->hasMessage() && server_->tryBegin(envelope));

    EXPECT_EQ(server_->cmdOfLong(envelope.body()), -7) << length;
    server_->discard(envelope.body());
  }
}

TEST_F(MessageLinkTest, AMessageThatIsRefusedStaysWithItsOwner) {
  auto message = Char8ArrayMessage::allocValue((1 << 20) + 1);  // Offer::maxMessageBytes

  EXPECT_EQ(send(message), LinkSend::tooLarge);

  EXPECT_EQ(message.getSize(), (1u << 20) + 1);
  EXPECT_FALSE(server_->hasMessage());
}

TEST_F(MessageLinkTest, AShortBodyHasNoChunk) {
  EXPECT_EQ(tryAllocate(layout::kInlineBodyBytes).data, nullptr);
}

TEST_F(MessageLinkTest, ALinkStaysUntilItsLastBodyReturns) {
  std::optional<Int32ArrayMessage> message(allocate(10'000));
  const auto link = client_->link().name();

  client_.reset();
  EXPECT_TRUE(segments::exists(link));
  EXPECT_EQ(message->value().back(), 9'999);
  message.reset();

  EXPECT_FALSE(segments::exists(link));
}

// The thread that holds the lock does not exist in the child.
TEST_F(MessageLinkTest, AForkedChildDoesNotWaitForTheLock) {
  Message message = allocate(10'000);
  ASSERT_EQ(send(message), LinkSend::sentInPlace);
  auto received = take();
  ASSERT_EQ(received.lender(), server_.get());
  std::optional<BiasedLock::Guard> guard(std::in_place, server_->lock());

  const auto child = ::fork();
  if (child == 0) {
    received.reset();
    server_.reset();
    ::_exit(0);
  }
  int status = -1;
  ::waitpid(child, &status, 0);
  guard.reset();

  EXPECT_EQ(status, 0);
}

TEST_F(MessageLinkTest, ADiscardedMessageReturnsItsChunk) {
  for (int i = 0; i < 100; ++i) {  // more than the pool holds at one time
    auto message = allocate(250'000);
    ASSERT_EQ(message.lender(), client_.get()) << "message " << i;
    ASSERT_EQ(send(message), LinkSend::sentInPlace);
    Envelope envelope;
    ASSERT_TRUE(server_->hasMessage() && server_->tryBegin(envelope));

    server_->discard(envelope.body());
  }
}

class InvalidEnvelopes : public MessageLinkTest,
                         public testing::WithParamInterface<void (*)(layout::Slot&)> {};

TEST_P(InvalidEnvelopes, AreRefused) {
  auto message = Message(Int32Message({.value = 1}));
  ASSERT_EQ(send(message), LinkSend::sent);
  GetParam()(firstSlot());
  Envelope envelope;

  ASSERT_TRUE(server_->hasMessage());
  EXPECT_FALSE(server_->tryBegin(envelope));
}
INSTANTIATE_TEST_SUITE_P(OfEachKind, InvalidEnvelopes,
                         testing::Values([](layout::Slot& slot) { slot.bodyBytes = 1000; },
                                         [](layout::Slot& slot) { slot.slots = 2; },
                                         [](layout::Slot& slot) {
                                           slot.slots = layout::kMaxMessageSlots + 1;
                                         },
                                         [](layout::Slot& slot) { slot.type = 0; }));

class InvalidSides : public MessageLinkTest, public testing::WithParamInterface<std::uint32_t> {};

TEST_P(InvalidSides, OfAChunkAreRefused) {
  auto message = allocate(10'000);
  ASSERT_TRUE(send(message) == LinkSend::sent || !message);
  const auto side = GetParam();
  std::memcpy(firstSlot().body.data() + offsetof(layout::ChunkRef, side), &side, sizeof side);

  EXPECT_FALSE(take());

  EXPECT_EQ(finish_, MessageLink::Finish::invalid);
}
// A client has no fan-out pool, and nobody has a pool of a side above.
INSTANTIATE_TEST_SUITE_P(OfNoPool, InvalidSides,
                         testing::Values(layout::kFanOutSide, layout::kFanOutSide + 1, UINT32_MAX));

TEST_F(MessageLinkTest, ABodyOfAnotherTypeThanItsSizeIsAMessageThatIsNotSound) {
  Envelope envelope{.type = static_cast<std::uint16_t>(MessageType::float64)};
  const Int32Message body;
  ASSERT_EQ(client_->link().trySend(envelope, body.body(), {}), LinkSend::sent);

  const auto message = take();

  EXPECT_EQ(finish_, MessageLink::Finish::message);
  EXPECT_FALSE(message.isSound());
}

}  // namespace
}  // namespace mpf::test
