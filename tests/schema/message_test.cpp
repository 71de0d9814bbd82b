// SPDX-License-Identifier: MIT
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <gmock/gmock.h>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <mpf/message_of.h>

#include "schema/visit.h"

namespace {

using namespace mpf;

static_assert(!std::is_copy_constructible_v<Message> && !std::is_copy_assignable_v<Message>);
static_assert(!std::is_copy_constructible_v<Int32Message> &&
              !std::is_copy_assignable_v<Int32ArrayMessage>);
static_assert(std::is_nothrow_move_constructible_v<Message> &&
              std::is_nothrow_move_assignable_v<Message>);
static_assert(std::is_nothrow_move_constructible_v<Float64ArrayMessage> &&
              std::is_nothrow_constructible_v<Int32Message, Int32>);
static_assert(noexcept(Message::adopt(MessageType::none, {})) &&
              noexcept(Int32Message::tryFrom(Message())));

// A block of memory in place of a link's pool; counts the bodies that are returned.
struct Pool final : BodyLender {
  alignas(64) std::array<std::byte, 4096> memory{};
  int returned = 0;
  std::byte* lastData = nullptr;
  std::size_t lastCapacity = 0;

  void takeBack(std::byte* data, std::size_t capacity) noexcept override {
    ++returned;
    lastData = data;
    lastCapacity = capacity;
  }
  BodyBytes lend(std::size_t size, std::size_t capacity = 4096) {
    return {memory.data(), size, capacity, this};
  }
  template <class T>
  void write(const T& fields) {
    std::memcpy(memory.data(), &fields, sizeof fields);
  }
};

// ---- scalars

TEST(Message, HoldsScalarsInTheHandle) {
  auto message = MessageOf(Int32{.timeout = 1, .address = 3, .value = -5});
  message.setClientExtra(7);
  message->status = -1;

  EXPECT_EQ(message.getType(), MessageType::int32);
  EXPECT_EQ(message->value, -5);
  EXPECT_EQ(message->status, -1);
  EXPECT_EQ(message.getClientExtra(), 7);
  EXPECT_EQ(message.body().size(), sizeof(Int32));
  EXPECT_EQ(message.lender(), nullptr);
  EXPECT_TRUE(message.isInline());
  EXPECT_EQ(MessageOf(Float64{.value = 2.5})->value, 2.5);
  EXPECT_EQ(ConnectMessage()->status, ConnectStatus::connectNo);
}

TEST(Message, IsEmptyWhenDefaultOrMovedFrom) {
  auto first = MessageOf(Int32{.value = 5});
  first.setRoute({.link = 9, .requestId = 8, .flags = 1});

  Message second = std::move(first);

  EXPECT_FALSE(Message());
  EXPECT_FALSE(first);  // NOLINT(bugprone-use-after-move)
  EXPECT_EQ(first.tryAs<Int32>(), nullptr);
  EXPECT_TRUE(first.body().empty());
  ASSERT_NE(second.tryAs<Int32>(), nullptr);
  EXPECT_EQ(second.tryAs<Int32>()->value, 5);
  EXPECT_EQ(second.route().link, 9U);
  EXPECT_EQ(second.route().requestId, 8U);
}

TEST(Message, IsOfOneTypeOnly) {
  Message message = MessageOf(Int32{.value = 5});

  EXPECT_EQ(message.tryAs<OutOfBand>(), nullptr);  // another type, although the layout is the same
  EXPECT_EQ(message.tryAs<Int32Array>(), nullptr);
  EXPECT_FALSE(Float64Message::tryFrom(std::move(message)));
  EXPECT_TRUE(message)
      << "a refused message stays with its owner";  // NOLINT(bugprone-use-after-move)
  const auto typed = Int32Message::tryFrom(std::move(message));
  ASSERT_TRUE(typed);
  EXPECT_EQ((*typed)->value, 5);
}

// ---- arrays

TEST(Message, AllocatesArraysAlignedAndWhole) {
  auto message = Float64ArrayMessage::allocValue(1000);
  std::ranges::fill(message.value(), 1.5);

  EXPECT_EQ(message.getLength(), 1000U);
  EXPECT_EQ(message.getMaxLength(), 1000U);
  EXPECT_EQ(message->length, 1000U);
  EXPECT_EQ(message->timeout, 0);
  EXPECT_EQ(message.body().size(), Float64ArrayMessage::bytesFor(1000));
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(message.body().data()) % 64, 0U);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(message.value().data()) % 8, 0U);
  EXPECT_EQ(message.lender(), &heapLender());
}

TEST(Message, RefusesMoreElementsThanALengthCanCount) {
  constexpr std::size_t kTooMany = std::size_t{1} << 32;

  EXPECT_EQ(Float64ArrayMessage::bytesFor(kTooMany - 1), 24 + 8 * (kTooMany - 1));
  EXPECT_THROW(static_cast<void>(Float64ArrayMessage::bytesFor(kTooMany)), std::length_error);
  EXPECT_THROW(static_cast<void>(Float64ArrayMessage::allocValue(SIZE_MAX / 8)), std::length_error);
}

TEST(Message, ShortensAndLengthensArraysWithinTheirRoom) {
  auto message = Int32ArrayMessage::allocValue(100);

  message.setLength(3);
  EXPECT_EQ(message.getLength(), 3U);
  EXPECT_EQ(message.value().size(), 3U);
  EXPECT_EQ(message->length, 3U);
  EXPECT_EQ(message.body().size(), 24U + 12U);

  message.setLength(100);
  EXPECT_EQ(message.value().size(), 100U);
  EXPECT_EQ(message.getMaxLength(), 100U);
}

TEST(Message, RefusesALengthAboveItsRoomAndNamesBoth) {
  auto message = Int32ArrayMessage::allocValue(100);

  try {
    message.setLength(101);
    FAIL() << "101 elements fit into room for 100";
  } catch (const std::length_error& error) {
    EXPECT_STREQ(error.what(), "int32Array: length 101 is too large: there is room for 100");
  }
  EXPECT_EQ(message.getLength(), 100U);
  EXPECT_THROW(message.setLength(SIZE_MAX), std::length_error);
}

TEST(Message, CountsBytesOfChar8ArraysAsSize) {
  auto message = Char8ArrayMessage::allocValue(4096);
  const std::string text = "*IDN?";

  message.setSize(text.size());
  std::ranges::copy(text, message.value().begin());

  EXPECT_EQ(message.getSize(), 5U);
  EXPECT_EQ(message.getMaxSize(), 4096U);
  EXPECT_THROW(message.setSize(4097), std::length_error);
  EXPECT_EQ(Char8ArrayMessage::allocValue(0).value().size(), 0U);
}

TEST(Message, RefusesLengthsAfterItsBodyWasMoved) {
  auto message = Char8ArrayMessage::allocValue(10);
  const Message taken = std::move(message);

  EXPECT_EQ(message.getMaxSize(), 0U);  // NOLINT(bugprone-use-after-move)
  EXPECT_TRUE(message.value().empty());
  EXPECT_THROW(message.setSize(0), std::length_error);
}

// ---- lenders

TEST(Message, ReturnsItsBodyOnce) {
  Pool pool;
  {
    auto message = Int32ArrayMessage::inBuffer(pool.lend(0, 256), 10);
    EXPECT_EQ(message.lender(), &pool);
    EXPECT_EQ(message.getMaxLength(), (256U - 24U) / 4U);
    Message moved = std::move(message);
    Message again;
    again = std::move(moved);
    EXPECT_EQ(pool.returned, 0);
  }
  EXPECT_EQ(pool.returned, 1);
  EXPECT_EQ(pool.lastData, pool.memory.data());
  EXPECT_EQ(pool.lastCapacity, 256U);
}

TEST(Message, ReturnsItsBodyWhenAnotherIsMovedIn) {
  Pool pool;
  Message message = Int32ArrayMessage::inBuffer(pool.lend(0), 10);

  message = MessageOf(Int32{.value = 5});

  EXPECT_EQ(pool.returned, 1);
  EXPECT_EQ(message.tryAs<Int32>()->value, 5);
}

TEST(Message, ReleasesItsBodyWithoutACallOfTheLender) {
  Pool pool;
  Message message = Int32ArrayMessage::inBuffer(pool.lend(0, 128), 10);

  const BodyBytes body = message.releaseBody();

  EXPECT_EQ(pool.returned, 0);
  EXPECT_FALSE(message);
  EXPECT_EQ(body.data, pool.memory.data());
  EXPECT_EQ(body.size, 24U + 40U);
  EXPECT_EQ(body.capacity, 128U);
  EXPECT_EQ(MessageOf(Int32{}).releaseBody().data, nullptr);
}

TEST(Message, RefusesABufferThatIsTooSmallAndReturnsIt) {
  Pool pool;

  EXPECT_THROW(static_cast<void>(Int32ArrayMessage::inBuffer(pool.lend(0, 60), 10)),
               std::length_error);
  EXPECT_THROW(static_cast<void>(Char8ArrayMessage::inBuffer(pool.lend(0, 39), 0)),
               std::length_error);

  EXPECT_EQ(pool.returned, 2);
}

// ---- bodies from a peer

TEST(Message, TakesTheLengthOfAnArrayFromItsBodyWhateverThePeerWrites) {
  Pool pool;
  pool.write(Int32Array{.address = 3, .length = UINT32_MAX});
  auto message =
      *Int32ArrayMessage::tryFrom(Message::adopt(MessageType::int32Array, pool.lend(24 + 20)));

  pool.write(Int32Array{.address = 4, .length = 1});

  EXPECT_EQ(message.getLength(), 5U);
  EXPECT_EQ(message.value().size(), 5U);
  EXPECT_EQ(message->address, 4);
  const Message copy = message.duplicate();
  ASSERT_TRUE(copy.isSound());
  EXPECT_EQ(copy.valueAs<Int32Array>().size(), 5U);
  EXPECT_EQ(copy.tryAs<Int32Array>()->length, 5U) << "a copy has the length in its body, too";
}

// The first line of a body may be in the cache of another processor.
TEST(Message, DoesNotReadTheBodyToKnowItsLength) {
  Pool pool;
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  auto* const unreadable = ::mmap(nullptr, page, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(unreadable, MAP_FAILED);

  const auto message = Message::adopt(
      MessageType::float64Array, {static_cast<std::byte*>(unreadable), 24 + 5 * 8, page, &pool});

  EXPECT_EQ(message.arrayLength(), 5U);
  ::munmap(unreadable, page);
}

TEST(Message, TakesTheLengthOfABodyInTheHandleFromItsSize) {
  Pool pool;
  pool.write(Int32Array{.length = 1});
  const std::span<const std::byte> bytes = pool.memory;

  EXPECT_EQ(Message::copyInline(MessageType::int32Array, bytes.first(32)).arrayLength(), 2U);
  EXPECT_FALSE(Message::copyInline(MessageType::int32Array, bytes.first(31)).isSound());
}

TEST(Message, RefusesABodyThatEndsWithinAnElement) {
  Pool pool;
  pool.write(Float64Array{.length = 5});

  auto message = Message::adopt(MessageType::float64Array, pool.lend(24 + 6 * 8 - 1));

  EXPECT_FALSE(message.isSound());
  EXPECT_EQ(message.tryAs<Float64Array>(), nullptr);
  EXPECT_TRUE(message.valueAs<Float64Array>().empty());
  EXPECT_EQ(message.arrayLength(), 0U);
  EXPECT_FALSE(Float64ArrayMessage::tryFrom(std::move(message)));
}

TEST(Message, RefusesMoreElementsThanALengthCanSay) {
  Pool pool;
  auto body = pool.lend(sizeof(Char8Array));
  body.size = sizeof(Char8Array) + std::size_t{UINT32_MAX} + 1;

  EXPECT_FALSE(Message::adopt(MessageType::char8Array, body).isSound());
}

TEST(Message, RefusesMisalignedAndMissingBodies) {
  Pool pool;
  pool.write(Int32{});

  EXPECT_FALSE(
      Message::adopt(MessageType::int32, {pool.memory.data() + 4, 24, 24, &pool}).isSound());
  EXPECT_FALSE(Message::adopt(MessageType::int32, {}).isSound());
  EXPECT_FALSE(Message::adopt(MessageType::int32, pool.lend(23)).isSound());
  EXPECT_TRUE(Message::adopt(MessageType::int32, pool.lend(24)).isSound());
}

TEST(Message, KeepsABodyOfAnUnknownType) {
  const std::array<std::byte, 40> bytes{std::byte{1}};

  const auto message = Message::copyOf(MessageType{77}, bytes);

  EXPECT_TRUE(message);
  EXPECT_FALSE(message.isSound());
  EXPECT_EQ(message.getType(), MessageType{77});
  EXPECT_TRUE(std::ranges::equal(message.body(), bytes));
  EXPECT_FALSE(Message::copyOf(MessageType{UINT16_MAX}, {}).isSound());
}

TEST(Message, CopiesSmallBodiesIntoTheHandleAndLargeOnesOntoTheHeap) {
  Pool pool;
  pool.write(Int32Array{.length = 2});
  const std::span<const std::byte> bytes = pool.memory;

  auto small = Message::copyOf(MessageType::int32Array, bytes.first(32));
  auto large = Message::copyOf(MessageType::int32Array, bytes.first(36));

  EXPECT_TRUE(small.isInline());
  EXPECT_EQ(small.valueAs<Int32Array>().size(), 2U);
  EXPECT_EQ(large.lender(), &heapLender());
  EXPECT_EQ(large.valueAs<Int32Array>().size(), 3U);
  auto typed = *Int32ArrayMessage::tryFrom(std::move(small));
  EXPECT_EQ(typed.getMaxLength(), 2U);
  typed.setLength(1);
  EXPECT_EQ(typed.body().size(), 28U);
}

// A handle that is filled again does not keep the time of its former message.
TEST(Message, AnEmptiedHandleHasNoTimeStamp) {
  Message message = MessageOf(Int32{.value = 5});
  message.setTimeStampNs(6);

  auto moved = std::move(message);

  EXPECT_EQ(moved.getTimeStampNs(), 6);
  // NOLINTNEXTLINE(bugprone-use-after-move): what a move leaves is tested
  EXPECT_EQ(message.getTimeStampNs(), 0);
}

TEST(Message, DuplicatesItsClientFieldsTimeStampAndRoute) {
  auto message = MessageOf(Int32{.value = 5});
  message.setClientType(1);
  message.setClientExtra(2);
  message.setTimeStampNs(6);
  message.setRoute({.link = 3, .requestId = 4, .flags = 5});

  const auto copy = message.duplicate();

  EXPECT_EQ(copy.tryAs<Int32>()->value, 5);
  EXPECT_EQ(copy.getClientType(), 1);
  EXPECT_EQ(copy.getClientExtra(), 2);
  EXPECT_EQ(copy.getTimeStampNs(), 6);
  EXPECT_EQ(copy.route().flags, 5U);
}

// With any bytes and any type, all spans that are handed out are within the body; sanitizers check
// the reads.
TEST(Message, IsSafeWithAnyBytes) {
  const auto seed = std::random_device()();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  for (int round = 0; round < 20'000; ++round) {
    std::vector<std::byte> bytes(random() % 200);
    for (auto& byte : bytes) byte = static_cast<std::byte>(random() % 4 == 0 ? random() : 0);
    const auto message = Message::copyOf(static_cast<MessageType>(random() % 12), bytes);
    std::size_t read = 0;
    visitFields(message, [&](std::string_view, const auto& value) {
      if constexpr (requires { value.size_bytes(); }) {
        const auto inside = std::as_bytes(value);
        for (const auto byte : inside) read += byte != std::byte{};
        ASSERT_LE(inside.data() + inside.size(), message.body().data() + message.body().size());
      }
    });
    ASSERT_LE(read, bytes.size());
  }
}

}  // namespace
