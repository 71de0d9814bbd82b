// SPDX-License-Identifier: MIT
#include "epics/general/message_value.h"

#include <array>
#include <cmath>
#include <epicsTypes.h>
#include <gmock/gmock.h>
#include <limits>
#include <menuFtype.h>

namespace mpf::test {
namespace {

using testing::ElementsAre;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

MessageValue text(std::string_view characters) { return characters; }

TEST(MessageValue, RoundsAndRefusesWhatDoesNotFit) {
  EXPECT_EQ(fit<std::int32_t>(2.5), 3);
  EXPECT_EQ(fit<std::int32_t>(-2147483648.4), INT32_MIN);
  EXPECT_EQ(fit<std::int32_t>(2147483647.5), std::nullopt);
  EXPECT_EQ(fit<std::int64_t>(std::ldexp(1, 63)), std::nullopt);
  EXPECT_EQ(fit<std::int64_t>(-std::ldexp(1, 63)), INT64_MIN);
  EXPECT_EQ(fit<std::uint16_t>(-1), std::nullopt);
  EXPECT_EQ(fit<float>(1e300), std::nullopt);
  EXPECT_EQ(fit<float>(kInfinity), std::numeric_limits<float>::infinity());
  for (const double number : {kNan, kInfinity, -kInfinity})
    EXPECT_EQ(fit<std::int32_t>(number), std::nullopt);
}

TEST(MessageValue, AnIntegerThatADoubleCannotHoldDoesNotFit) {
  constexpr std::int64_t kOdd = (std::int64_t{1} << 53) + 1;
  EXPECT_EQ(fit<double>(kOdd), std::nullopt);
  EXPECT_EQ(fit<double>(kOdd + 1), 0x1p53 + 2);
  EXPECT_EQ(fit<double>(INT64_MAX), std::nullopt);
  EXPECT_EQ(fit<double>(INT64_MIN), -0x1p63);
  EXPECT_EQ(fit<double>(UINT64_MAX), std::nullopt);
  EXPECT_EQ(fit<float>(16'777'217), 0x1p24F) << "a float is rounded";
  EXPECT_EQ(toDouble(kOdd), std::nullopt);

  std::vector<double> scratch;
  const std::array<std::int64_t, 2> elements{1, kOdd};
  EXPECT_TRUE(loadElements(menuFtypeINT64, elements.data(), 1, scratch));
  EXPECT_FALSE(loadElements(menuFtypeINT64, elements.data(), 2, scratch));
}

TEST(MessageValue, ConvertsTextToTheNumberAtItsStart) {
  EXPECT_EQ(toDouble(text(" +2.5e1 V\r\n")), 25);
  EXPECT_EQ(toInteger(text("-7")), -7);
  EXPECT_EQ(toInteger(text("9007199254740993")), 9007199254740993);
  EXPECT_EQ(toInteger(text("2.5e1 V")), 25);
  EXPECT_EQ(toInteger(text("1e999")), std::nullopt);
  EXPECT_EQ(toDouble(text("V 3")), std::nullopt);
  EXPECT_EQ(toDouble(text("")), std::nullopt);
  EXPECT_EQ(toDouble(text(std::string_view("\0005", 2))), std::nullopt);
}

TEST(MessageValue, ConvertsNumbersToText) {
  EXPECT_EQ(toText(std::int64_t{-5}), "-5");
  EXPECT_EQ(toText(0.25), "0.25");
  EXPECT_EQ(toText(text(std::string_view("ab\0c", 4))), "ab");
  EXPECT_EQ(toText(std::span<const double>{}), std::nullopt);
}

TEST(MessageValue, TakesTheFirstElementOfAnArray) {
  const std::array<std::int32_t, 2> elements{4, 5};

  EXPECT_EQ(toInteger(std::span<const std::int32_t>(elements)), 4);
  EXPECT_EQ(toDouble(std::span<const double>{}), std::nullopt);
}

TEST(MessageValue, BitsAreOfASignedOrAnUnsignedNumber) {
  EXPECT_EQ(toBits(std::int64_t{-1}), 0xffffffffU);
  EXPECT_EQ(toBits(4294967295.0), 0xffffffffU);
  EXPECT_EQ(toBits(4294967296.0), std::nullopt);
}

TEST(MessageValue, ReadsTheStatusAndTheValueOfEachType) {
  const auto reading = readingOf(Int32Message({.status = -2, .value = 3}));
  ASSERT_TRUE(reading);
  EXPECT_EQ(reading->status, -2);
  EXPECT_EQ(toInteger(reading->value), 3);

  const auto bytes = Char8ArrayMessage::allocValue(0);
  EXPECT_EQ(toText(readingOf(bytes)->value), "");
  EXPECT_FALSE(readingOf(SerialConfigMessage()));
  EXPECT_FALSE(readingOf(Message()));
}

TEST(MessageValue, MakesRequestsWithTheFieldsOfTheLink) {
  const LinkOptions options{
      .type = MessageType::float64, .address = 3, .extra = 4, .value = 0.5, .timeout = 0.1};
  const auto request = makeQuery(options, 9);

  ASSERT_TRUE(request);
  const auto* fields = request->tryAs<Float64>();
  ASSERT_NE(fields, nullptr);
  EXPECT_EQ(fields->timeout, 1);
  EXPECT_EQ(fields->cmd, 9);
  EXPECT_EQ(fields->address, 3);
  EXPECT_EQ(fields->extra, 4);
  EXPECT_EQ(fields->value, 0.5);
}

TEST(MessageValue, MakesNoMessageFromAValueThatDoesNotFit) {
  EXPECT_FALSE(makeMessage({.type = MessageType::int32}, 0, 3e9));
  EXPECT_FALSE(makeMessage({.type = MessageType::int32}, 0, text("x")));
  EXPECT_FALSE(makeMessage({.type = MessageType::int32Array}, 0, kNan));
}

TEST(MessageValue, MakesArraysAndText) {
  const std::array<double, 2> numbers{1.4, -2};
  const auto array =
      makeMessage({.type = MessageType::int32Array}, 0, std::span<const double>(numbers));
  const auto characters = makeMessage({.type = MessageType::char8Array}, 0, 2.5);

  EXPECT_THAT(array->valueAs<Int32Array>(), ElementsAre(1, -2));
  EXPECT_THAT(characters->valueAs<Char8Array>(), ElementsAre('2', '.', '5'));
}

TEST(MessageValue, StoresElementsUpToTheRoomOfTheRecord) {
  std::array<epicsInt16, 3> field{};
  std::uint32_t used = 0;
  const std::array<std::int32_t, 4> elements{1, -2, 3, 4};
  const std::span<const std::int32_t> all(elements);

  EXPECT_EQ(storeElements(all.first(2), menuFtypeSHORT, field.data(), 3, used), Stored::done);
  EXPECT_EQ(used, 2U);
  EXPECT_EQ(storeElements(all, menuFtypeSHORT, field.data(), 3, used), Stored::truncated);
  EXPECT_EQ(used, 3U);
  EXPECT_THAT(field, ElementsAre(1, -2, 3));
}

TEST(MessageValue, AnElementThatDoesNotFitLeavesTheArrayUnchanged) {
  std::array<epicsInt16, 2> field{8, 9};
  std::uint32_t used = 2;
  const std::array<double, 2> elements{1, kNan};

  EXPECT_EQ(storeElements(std::span<const double>(elements), menuFtypeSHORT, field.data(), 2, used),
            Stored::doesNotFit);

  EXPECT_THAT(field, ElementsAre(8, 9));
  EXPECT_EQ(used, 2U);
}

TEST(MessageValue, BytesKeepTheirBitsInCharArraysAndAreNumbersInOthers) {
  std::array<epicsInt8, 1> chars{};
  std::array<epicsFloat64, 1> doubles{};
  std::uint32_t used = 0;

  EXPECT_EQ(storeElements(text("\xff"), menuFtypeCHAR, chars.data(), 1, used), Stored::done);
  EXPECT_EQ(storeElements(text("\xff"), menuFtypeDOUBLE, doubles.data(), 1, used), Stored::done);

  EXPECT_EQ(chars[0], -1);
  EXPECT_EQ(doubles[0], 255);
}

TEST(MessageValue, LoadsElementsOfEachWidth) {
  std::vector<double> scratch;
  const std::array<epicsUInt16, 2> shorts{1, 65535};

  const auto value = loadElements(menuFtypeUSHORT, shorts.data(), 2, scratch);
  EXPECT_THAT(std::get<std::span<const double>>(value.value()), ElementsAre(1, 65535));
  EXPECT_EQ(std::get<std::string_view>(*loadElements(menuFtypeUCHAR, "ab", 2, scratch)), "ab");
  EXPECT_EQ(messageTypeOf(menuFtypeUSHORT), MessageType::int32Array);
  EXPECT_EQ(messageTypeOf(menuFtypeULONG), MessageType::float64Array);
  EXPECT_EQ(messageTypeOf(menuFtypeSTRING), MessageType::none);
}

}  // namespace
}  // namespace mpf::test
