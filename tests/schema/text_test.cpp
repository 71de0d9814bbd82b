// SPDX-License-Identifier: MIT
#include "schema/text.h"

#include <cmath>
#include <gmock/gmock.h>
#include <sstream>

#include <mpf/message_of.h>

#include "schema/json.h"

namespace {

using namespace mpf;
using OptionFields = std::vector<std::string>;

template <class T>
MessageOf<T> parsed(const OptionFields& words) {
  std::string error;
  auto message = tryParse(T::kType, words, error);
  EXPECT_TRUE(message) << error;
  return std::move(MessageOf<T>::tryFrom(std::move(message.value())).value());
}

std::string refusal(MessageType type, const OptionFields& words) {
  std::string error;
  EXPECT_FALSE(tryParse(type, words, error));
  return error;
}

TEST(Text, PrintsEachMessageAsOneLine) {
  auto message = MessageOf(Int32{.timeout = 1, .address = 3, .value = -5});
  EXPECT_EQ(print(message), "int32 timeout=1 cmd=0 status=0 address=3 extra=0 value=-5");

  message.setClientExtra(9);
  EXPECT_EQ(print(message),
            "int32 timeout=1 cmd=0 status=0 address=3 extra=0 value=-5 clientExtra=9");

  EXPECT_EQ(print(MessageOf(Connect{.status = ConnectStatus::connectYes, .incarnation = 7})),
            "connect status=connectYes incarnation=7");
  EXPECT_EQ(print(MessageOf(RequestFate{.fate = Fate{9}, .requestId = 4})),
            "requestFate fate=9 requestId=4");
  EXPECT_EQ(print(MessageOf(SerialConfig{.baud = 9600, .parity = 'E'})),
            "serialConfig baud=9600 stopBits=0 bitsPerChar=0 parity=E flowControl=0");
}

TEST(Text, PrintsBytesAsCStrings) {
  const auto message = parsed<Char8Array>({R"(value=*IDN?\r\n\x00\xfe")", R"(eomString="\r\n")"});

  EXPECT_EQ(
      print(message),
      R"(char8Array timeout=0 cmd=0 status=0 address=0 extra=0 numberRetrys=0 eomLen=2 eomString="\r\n" value="*IDN?\r\n\x00\xfe\"")");
}

TEST(Text, ShortensLongArrays) {
  EXPECT_THAT(print(parsed<Int32Array>({"value=1,2,3"}), 2),
              testing::EndsWith(" value=1,2,... (3)"));
  EXPECT_THAT(print(parsed<Int32Array>({"value=1,2,3"}), 3), testing::EndsWith(" value=1,2,3"));
  EXPECT_THAT(print(parsed<Char8Array>({"value=abc"}), 2),
              testing::EndsWith(R"( value="ab"... (3))"));
}

TEST(Text, ReportsAnInvalidBody) {
  EXPECT_EQ(print(Message()), "none");
  EXPECT_EQ(print(Message::copyOf(MessageType{77}, {})),
            "type 77: not one of ours, a body of 0 bytes");
  EXPECT_EQ(print(Message::copyOf(MessageType::int32, {})),
            "int32: not one of ours, a body of 0 bytes");
}

TEST(Text, ParsesTheWordsOfAShell) {
  const auto message =
      parsed<Int32>({"value=-2147483648", "address=0x1f", "timeout=1", "clientExtra=4"});

  EXPECT_EQ(message->value, INT32_MIN);
  EXPECT_EQ(message->address, 31);
  EXPECT_EQ(message->timeout, 1);
  EXPECT_EQ(message->cmd, 0);
  EXPECT_EQ(message.getClientExtra(), 4);
}

// A hexadecimal number gives all bits of a field, the sign bit included.
TEST(Text, ParsesHexadecimalNumbersAsBitPatterns) {
  EXPECT_EQ(parsed<Int32>({"address=0xffffffff"})->address, -1);
  EXPECT_EQ(parsed<Int32>({"address=0x80000000"})->address, INT32_MIN);
  EXPECT_EQ(parsed<Int32>({"address=-0x1"})->address, -1);
  EXPECT_THAT(parsed<Int32Array>({"value=0xfffffffe,2"}).value(), testing::ElementsAre(-2, 2));
  EXPECT_EQ(parsed<Connect>({"incarnation=0xffffffffffffffff"})->incarnation, UINT64_MAX);
}

TEST(Text, ParsesArrays) {
  EXPECT_THAT(parsed<Int32Array>({"value=1,-2,3", "cmd=2"}).value(),
              testing::ElementsAre(1, -2, 3));
  EXPECT_EQ(parsed<Int32Array>({"value=1,2", "cmd=2"})->cmd, 2);
  EXPECT_EQ(parsed<Int32Array>({"value=1,2"})->length, 2U);
  EXPECT_THAT(parsed<Float64Array>({"value=1.5,-1e300,+2"}).value(),
              testing::ElementsAre(1.5, -1e300, 2.0));
  EXPECT_TRUE(parsed<Int32Array>({}).value().empty());
  EXPECT_TRUE(parsed<Float64Array>({"value="}).value().empty());
  EXPECT_THAT(parsed<User>({"value=00ff"}).value(),
              testing::ElementsAre(std::byte{0}, std::byte{0xff}));
  EXPECT_THAT(parsed<Char8Array>({"value=a=b,c"}).value(),
              testing::ElementsAre('a', '=', 'b', ',', 'c'));
}

TEST(Text, SetsTheEndOfMessageLengthFromItsString) {
  const auto message = parsed<Char8Array>({R"(eomString=\r\n)"});

  EXPECT_EQ(message->eomLen, 2);
  EXPECT_EQ(message->eom(), "\r\n");
  EXPECT_EQ(parsed<Char8Array>({R"(eomString=\r\n)", "eomLen=1"})->eom(), "\r");
}

TEST(Text, NamesTheInvalidFieldAndTheValidOnes) {
  EXPECT_EQ(
      refusal(MessageType::int32, {"adress=3"}),
      "int32: unknown field \"adress\"; use one of timeout, cmd, status, address, extra, value, "
      "clientType, clientExtra");
  EXPECT_EQ(
      refusal(MessageType::serialConfig, {"value=3"}),
      "serialConfig: unknown field \"value\"; use one of baud, stopBits, bitsPerChar, parity, "
      "flowControl, clientType, clientExtra");
  EXPECT_EQ(refusal(MessageType::int32, {"value"}), "int32: \"value\" is not field=value");
  EXPECT_EQ(
      refusal(MessageType::int32, {"value=2147483648"}),
      "int32: field \"value\" is an integer from -2147483648 to 2147483647, not \"2147483648\"");
  EXPECT_EQ(refusal(MessageType::serialConfig, {"parity=EO"}),
            "serialConfig: field \"parity\" is one character, or 0, not \"EO\"");
  EXPECT_EQ(refusal(MessageType::connect, {"status=yes"}),
            "connect: field \"status\" is one of connectNo connectYes connectQueueFull "
            "connectRefused, not \"yes\"");
  EXPECT_EQ(
      refusal(MessageType::char8Array, {"eomString=12345"}),
      "char8Array: field \"eomString\" is a C-escaped string of at most 4 bytes, not \"12345\"");
  EXPECT_EQ(refusal(MessageType{77}, {}), "type 77 is unknown");
}

TEST(Text, RefusesWordsThatAreAlmostNumbers) {
  for (const auto* const bad :
       {"value=", "value=1x", "value= 1", "value=-", "value=0x", "value=--1", "value=1.5",
        "value=-2147483649", "value=0x100000000", "value=-0x80000001", "value=4294967295"}) {
    EXPECT_NE(refusal(MessageType::int32, {bad}), "") << bad;
  }
  for (const auto* const bad : {"value=1,,2", "value=1,", "value=,1", "value=1;2"}) {
    EXPECT_NE(refusal(MessageType::int32Array, {bad}), "") << bad;
  }
  for (const auto* const bad : {"value=", "value=1x", "value=1e999"})
    EXPECT_NE(refusal(MessageType::float64, {bad}), "") << bad;
  for (const auto* const bad : {R"(value=\)", R"(value=\q)", R"(value=\x)"})
    EXPECT_NE(refusal(MessageType::char8Array, {bad}), "") << bad;
  EXPECT_NE(refusal(MessageType::requestFate, {"requestId=-1"}), "");
  EXPECT_NE(refusal(MessageType::user, {"value=0"}), "");
}

TEST(Text, FindsTypesByName) {
  EXPECT_EQ(tryParseType("float64Array"), MessageType::float64Array);
  EXPECT_EQ(tryParseType("none"), std::nullopt);
  EXPECT_EQ(tryParseType("Int32"), std::nullopt);
  EXPECT_EQ(typeNames(),
            "connect, int32, int32Array, float64, float64Array, char8Array, serialConfig, "
            "outOfBand, requestFate, user");
}

// tryParse() reads what print() has written, for each type with unusual values in its fields.
TEST(Text, ParsesWhatItPrinted) {
  const std::vector<std::pair<MessageType, OptionFields>> messages{
      {MessageType::connect, {"status=connectQueueFull", "incarnation=18446744073709551615"}},
      {MessageType::int32,
       {"timeout=-1", "cmd=2", "status=3", "address=4", "extra=5", "value=6", "clientType=7"}},
      {MessageType::int32Array, {"value=1,2,3", "extra=5"}},
      {MessageType::float64, {"value=0.1"}},
      {MessageType::float64Array, {"value=-0,inf,-inf,nan,5e-324,1.7976931348623157e+308"}},
      {MessageType::char8Array, {R"(value= a"b\\\x01\xff)", R"(eomString=\n)", "numberRetrys=2"}},
      {MessageType::serialConfig, {"baud=9600", "parity=N", "flowControl=H"}},
      {MessageType::outOfBand, {"value=-6"}},
      {MessageType::requestFate, {"fate=cancelled", "requestId=4294967295"}},
      {MessageType::user, {"value=0123456789abcdef"}}};
  for (const auto& [type, words] : messages) {
    std::string error;
    const auto first = tryParse(type, words, error);
    ASSERT_TRUE(first) << error;
    const auto line = print(*first);
    OptionFields again;  // a field begins at " name="; no value above contains this
    for (std::size_t at = line.find(' '); at != line.npos;) {
      std::size_t next = line.find(' ', at + 1);
      while (next != line.npos && line.find('=', next) == line.npos)
        next = line.find(' ', next + 1);
      if (line.compare(at, 9, R"( value=" )") == 0) next = line.npos;
      again.push_back(line.substr(at + 1, next == line.npos ? next : next - at - 1));
      at = next;
    }

    const auto second = tryParse(type, again, error);

    ASSERT_TRUE(second) << error;
    EXPECT_EQ(line, print(*second));
    if (type != MessageType::float64Array) {
      EXPECT_TRUE(std::ranges::equal(first->body(), second->body())) << line;
    }
  }
}

TEST(Json, HasEveryField) {
  auto message = parsed<Float64Array>({"value=1.5,nan,-inf", "address=3", "clientExtra=2"});

  EXPECT_EQ(
      toJson(message),
      nlohmann::json::parse(
          R"({"type":"float64Array","clientType":0,"clientExtra":2,"timeout":0,"cmd":0,"status":0,
              "address":3,"extra":0,"value":[1.5,"nan","-inf"]})"));
}

TEST(Json, WritesOneCharacterForEachByte) {
  const auto json = toJson(parsed<Char8Array>({R"(value=a\x00\xff)", R"(eomString=\r)"}));

  EXPECT_EQ(json["value"], std::string("a\0\xc3\xbf", 4));
  EXPECT_EQ(json["eomString"], "\r");
  EXPECT_NO_THROW(static_cast<void>(json.dump()));
  EXPECT_EQ(toJson(parsed<User>({"value=00fe"}))["value"], "00fe");
}

TEST(Json, ReportsTheSizeOfAnInvalidBody) {
  EXPECT_EQ(
      toJson(Message::copyOf(MessageType{77}, {})),
      nlohmann::json::parse(R"({"type":"unknown","clientType":0,"clientExtra":0,"bytes":0})"));
}

}  // namespace
