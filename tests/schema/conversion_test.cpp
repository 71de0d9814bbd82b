// SPDX-License-Identifier: MIT
#include "schema/conversion.h"

#include <bit>
#include <capnp/dynamic.h>
#include <capnp/serialize.h>
#include <gmock/gmock.h>
#include <limits>
#include <random>

#include <mpf/message_of.h>

#include "schema/text.h"
#include "tests/support/sanitized.h"

namespace {

using namespace mpf;

constexpr auto kMin = std::numeric_limits<std::int32_t>::min();
constexpr auto kMax = std::numeric_limits<std::int32_t>::max();

kj::Array<capnp::word> toFrame(const Message& message, const ConversionLimits& limits = {}) {
  capnp::MallocMessageBuilder builder;
  ConversionError error;
  EXPECT_TRUE(tryToWire(message, builder.initRoot<wire::Envelope>(), limits, error)) << error.text;
  return capnp::messageToFlatArray(builder);
}

std::optional<Message> fromFrame(kj::ArrayPtr<const capnp::word> frame, ConversionError& error,
                                 const ConversionLimits& limits = {}) {
  capnp::FlatArrayMessageReader reader(frame, limits.readerOptions());
  return tryFromWire(reader.getRoot<wire::Envelope>(), limits, error);
}

// Converts a message to an Envelope and back.
template <class T>
MessageOf<T> roundTrip(const MessageOf<T>& message) {
  ConversionError error;
  auto back = fromFrame(toFrame(message), error);
  EXPECT_TRUE(back) << error.text;
  if (!back) throw std::runtime_error(error.text);
  auto typed = MessageOf<T>::tryFrom(std::move(*back));
  EXPECT_TRUE(typed) << T::kName;
  return std::move(typed.value());
}

// All bits of all fields are kept.
template <class T>
void expectSame(const MessageOf<T>& message) {
  const auto back = roundTrip(message);
  EXPECT_EQ(0, std::memcmp(&*message, &*back, sizeof(T))) << print(message) << "\n" << print(back);
  ASSERT_EQ(message.body().size(), back.body().size());
  EXPECT_EQ(0, std::memcmp(message.body().data(), back.body().data(), back.body().size()))
      << print(message) << "\n"
      << print(back);
  EXPECT_EQ(message.getClientType(), back.getClientType());
  EXPECT_EQ(message.getClientExtra(), back.getClientExtra());
}

TEST(Conversion, KeepsEveryFieldOfEveryScalar) {
  expectSame(
      MessageOf(Connect{.status = ConnectStatus::connectQueueFull, .incarnation = UINT64_MAX}));
  expectSame(
      MessageOf(Int32{.timeout = 1, .cmd = 2, .status = 3, .address = 4, .extra = 5, .value = 6}));
  expectSame(MessageOf(Int32{
      .timeout = kMin, .cmd = kMax, .status = kMin, .address = -1, .extra = kMax, .value = kMin}));
  expectSame(MessageOf(
      Float64{.timeout = 1, .cmd = 2, .status = 3, .address = 4, .extra = 5, .value = 6.5}));
  expectSame(MessageOf(SerialConfig{
      .baud = 115200, .stopBits = 2, .bitsPerChar = 7, .parity = 'E', .flowControl = '\xff'}));
  expectSame(MessageOf(
      OutOfBand{.timeout = 1, .cmd = 2, .status = 3, .address = 4, .extra = 5, .value = 6}));
  for (const auto fate :
       {Fate::refused, Fate::neverTaken, Fate::outcomeUnknown, Fate::expired, Fate::cancelled}) {
    expectSame(MessageOf(RequestFate{.fate = fate, .requestId = UINT32_MAX}));
  }
}

TEST(Conversion, KeepsClientTypeAndClientExtra) {
  auto message = MessageOf(Int32{});
  message.setClientType(kMin);
  message.setClientExtra(kMax);

  expectSame(message);
}

constexpr std::array kHardBits{
    std::uint64_t{0x0000000000000000},  // 0
    std::uint64_t{0x8000000000000000},  // -0.0
    std::uint64_t{0x7ff0000000000000},  // inf
    std::uint64_t{0xfff0000000000000},  // -inf
    std::uint64_t{0x7ff8000000000000},  // quiet NaN
    std::uint64_t{0x7ff0000000000001},  // signalling NaN
    std::uint64_t{0xfff4deadbeef1234},  // negative signalling NaN with a payload
    std::uint64_t{0x0000000000000001},  // smallest denormal
    std::uint64_t{0x7fefffffffffffff},  // largest
};

TEST(Conversion, KeepsEveryBitOfADouble) {
  auto message = Float64ArrayMessage::allocValue(kHardBits.size());
  std::memcpy(message.value().data(), kHardBits.data(), sizeof kHardBits);

  expectSame(message);
  for (const auto bits : kHardBits) {
    Float64 fields;
    std::memcpy(&fields.value, &bits, sizeof bits);
    expectSame(MessageOf(fields));
  }
}

template <class T>
MessageOf<T> filled(std::size_t n) {
  auto message = MessageOf<T>::allocValue(n);
  auto* const bytes = reinterpret_cast<unsigned char*>(message.value().data());
  for (std::size_t i = 0; i < message.value().size_bytes(); ++i)
    bytes[i] = static_cast<unsigned char>(i * 37 + i / 251);
  return message;
}

TEST(Conversion, KeepsArraysOfAnyLength) {
  for (const std::size_t n : {0, 1, 2, 7, 8, 9, 1000}) {
    expectSame(filled<Int32Array>(n));
    expectSame(filled<Float64Array>(n));
    expectSame(filled<Char8Array>(n));
    expectSame(filled<User>(n));
  }
  auto message = filled<Char8Array>(5);
  message->numberRetrys = 3;
  message->eomLen = 2;
  message->eomString = {'\r', '\n', '\0', '\xff'};
  message->extra = kMin;
  expectSame(message);
}

TEST(Conversion, KeepsExtremeValuesOfAnInt32Array) {
  auto message = Int32ArrayMessage::allocValue(4);
  std::ranges::copy(std::array{kMin, kMax, 0, -1}, message.value().begin());

  expectSame(message);
}

TEST(Conversion, KeepsArraysOf64MiB) {
  if (mpf::test::kIsSanitized) GTEST_SKIP() << "for a sanitizer, smaller arrays are sufficient";
  if (std::endian::native == std::endian::big) GTEST_SKIP() << "takes minutes under emulation";
  constexpr std::size_t kBytes = std::size_t{64} << 20;
  expectSame(filled<Float64Array>(kBytes / 8));
  expectSame(filled<Int32Array>(kBytes / 4));
  expectSame(filled<Char8Array>(kBytes));
}

// ---- refusals

TEST(Conversion, RefusesArraysAboveTheLimitInBothDirections) {
  const auto message = filled<Float64Array>(100);
  capnp::MallocMessageBuilder builder;
  ConversionError error;

  EXPECT_FALSE(
      tryToWire(message, builder.initRoot<wire::Envelope>(), {.maxValueBytes = 799}, error));
  EXPECT_EQ(error.fault, ConversionFault::tooLarge);
  EXPECT_EQ(error.text, "float64Array.value: 800 bytes, the limit is 799");
  EXPECT_TRUE(
      tryToWire(message, builder.initRoot<wire::Envelope>(), {.maxValueBytes = 800}, error));
  EXPECT_EQ(error.fault, ConversionFault::none);

  const auto frame = toFrame(filled<Char8Array>(100));
  EXPECT_FALSE(fromFrame(frame, error, {.maxValueBytes = 99}));
  EXPECT_EQ(error.fault, ConversionFault::tooLarge);
  EXPECT_EQ(error.text, "char8Array.value: 100 bytes, the limit is 99");
  EXPECT_TRUE(fromFrame(frame, error, {.maxValueBytes = 100}));
}

TEST(Conversion, ReadsUpToTheLimitWithItsReaderOptions) {
  ConversionError error;
  EXPECT_TRUE(fromFrame(toFrame(filled<Float64Array>(100'000)), error, {.maxValueBytes = 800'000}))
      << error.text;
}

TEST(Conversion, NamesATypeFromANewerPeer) {
  capnp::MallocMessageBuilder builder;
  builder.initRoot<wire::Envelope>().initUser();
  // The discriminant is the 16-bit word with the number of `user`, the last member; the next number
  // is unknown.
  auto data = capnp::AnyStruct::Builder(builder.getRoot<capnp::AnyStruct>()).getDataSection();
  const unsigned offset =
      capnp::Schema::from<wire::Envelope>().getProto().getStruct().getDiscriminantOffset() * 2;
  ASSERT_EQ(data[offset], 9);
  data[offset] = 10;
  ConversionError error;

  const auto message = fromFrame(capnp::messageToFlatArray(builder), error);

  EXPECT_FALSE(message);
  EXPECT_EQ(error.fault, ConversionFault::unknownType);
  EXPECT_EQ(error.text, "type 11 is unknown: the peer is newer");
  data[offset] = 0xff;
  data[offset + 1] = 0xff;
  EXPECT_FALSE(fromFrame(capnp::messageToFlatArray(builder), error));
  EXPECT_EQ(error.fault, ConversionFault::unknownType);
}

TEST(Conversion, RefusesUnknownTypesAndInvalidBodies) {
  capnp::MallocMessageBuilder builder;
  ConversionError error;
  const auto envelope = builder.initRoot<wire::Envelope>();

  EXPECT_FALSE(tryToWire(Message::copyOf(MessageType{77}, {}), envelope, {}, error));
  EXPECT_EQ(error.fault, ConversionFault::unknownType);
  EXPECT_FALSE(tryToWire(Message(), envelope, {}, error));
  EXPECT_EQ(error.fault, ConversionFault::unknownType);
  const std::array<std::byte, 10> shortBody{};
  EXPECT_FALSE(tryToWire(Message::copyOf(MessageType::int32, shortBody), envelope, {}, error));
  EXPECT_EQ(error.fault, ConversionFault::unsound);
  EXPECT_EQ(error.text, "int32: a body of 10 bytes is invalid");
  EXPECT_FALSE(tryToWire(MessageOf(RequestFate{.fate = Fate{-3}}), envelope, {}, error));
  EXPECT_EQ(error.text, "requestFate.fate: -3 is not a value of this type");
}

TEST(Conversion, KeepsAnUnknownStatusOfANewerPeer) {
  expectSame(MessageOf(Connect{.status = ConnectStatus{4000}}));
}

TEST(Conversion, RefusesAnEndOfMessageStringThatDoesNotFit) {
  capnp::MallocMessageBuilder builder;
  builder.initRoot<wire::Envelope>().initChar8Array().setEomString(
      kj::StringPtr("too long").asBytes());
  ConversionError error;

  EXPECT_FALSE(fromFrame(capnp::messageToFlatArray(builder), error));

  EXPECT_EQ(error.fault, ConversionFault::malformed);
  EXPECT_EQ(error.text, "char8Array.eomString: 8 bytes, there is room for 4");
}

TEST(Conversion, ReadsAMissingStructAsZeros) {
  capnp::MallocMessageBuilder builder;
  builder.initRoot<wire::Envelope>();
  ConversionError error;

  const auto message = fromFrame(capnp::messageToFlatArray(builder), error);

  ASSERT_TRUE(message) << error.text;
  EXPECT_EQ(message->getType(), MessageType::connect);
}

// A frame with flipped bits becomes a message, or an error with a text.
TEST(Conversion, SurvivesAnyDamage) {
  const auto seed = std::random_device()();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const auto sound = toFrame(filled<Int32Array>(20));
  int refused = 0;
  for (int round = 0; round < 20'000; ++round) {
    auto frame = kj::heapArray<capnp::word>(sound.asPtr());
    auto bytes = frame.asBytes();
    for (int flips = 0; flips < 3; ++flips)
      bytes[8 + random() % (bytes.size() - 8)] ^= static_cast<capnp::byte>(1U << (random() % 8));
    ConversionError error;
    try {
      const auto message = fromFrame(frame, error, {.maxValueBytes = 4096});
      ASSERT_EQ(message.has_value(), error.fault == ConversionFault::none);
      ASSERT_EQ(message.has_value(), error.text.empty());
      refused += !message;
    } catch (const kj::Exception&) {  // thrown by getRoot(), before the conversion
      ++refused;
    }
  }
  EXPECT_GT(refused, 0);
}

}  // namespace
