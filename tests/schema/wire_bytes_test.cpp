// SPDX-License-Identifier: MIT
// The bytes of each message on the wire are those of wire_bytes.txt, on hosts of either byte order
// and in every release.
#include <capnp/serialize.h>
#include <fmt/format.h>
#include <fstream>
#include <gmock/gmock.h>
#include <string>
#include <vector>

#include "schema/conversion.h"
#include "schema/text.h"
#include "tests/support/every_message.h"

namespace {

using namespace mpf;

class WireBytes : public testing::Test {
 protected:
  // Each Envelope in standard segment framing, in the format of toText().
  static std::vector<std::string> expected() {
    std::ifstream file(MPF_TEST_WIRE_BYTES);
    std::vector<std::string> frames;
    for (std::string line; std::getline(file, line);) {
      if (!line.starts_with('#')) frames.push_back(line);
    }
    return frames;
  }
  // Hexadecimal digits in groups of one word.
  static std::string toText(const Message& message) {
    capnp::MallocMessageBuilder builder;
    ConversionError error;
    EXPECT_TRUE(tryToWire(message, builder.initRoot<wire::Envelope>(), {}, error)) << error.text;
    const auto frame = capnp::messageToFlatArray(builder);
    std::string text;
    for (const auto byte : frame.asBytes())
      text += fmt::format("{}{:02x}", text.size() % 17 == 16 ? " " : "", byte);
    return text;
  }
  static kj::Array<capnp::word> toFrame(const std::string& text) {
    auto frame = kj::heapArray<capnp::word>((text.size() + 1) / 17);
    auto bytes = frame.asBytes();
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      bytes[i] =
          static_cast<kj::byte>(std::stoi(text.substr(i / 8 * 17 + i % 8 * 2, 2), nullptr, 16));
    }
    return frame;
  }
  const std::vector<Message> messages_ = test::everyMessage();
  const std::vector<std::string> expected_ = expected();
};

TEST_F(WireBytes, OfEveryMessageAreTheSameOnEveryHost) {
  ASSERT_EQ(messages_.size(), expected_.size());
  for (std::size_t i = 0; i < messages_.size(); ++i)
    EXPECT_EQ(toText(messages_[i]), expected_[i]) << print(messages_[i]);
}

TEST_F(WireBytes, AreReadAsTheSameMessageOnEveryHost) {
  ASSERT_EQ(messages_.size(), expected_.size());
  for (std::size_t i = 0; i < messages_.size(); ++i) {
    const auto frame = toFrame(expected_[i]);
    capnp::FlatArrayMessageReader reader(frame);
    ConversionError error;

    const auto message = tryFromWire(reader.getRoot<wire::Envelope>(), {}, error);

    ASSERT_TRUE(message) << error.text;
    EXPECT_TRUE(test::isSame(*message, messages_[i])) << print(*message) << "\n"
                                                      << print(messages_[i]);
  }
}

// A user's own struct is read with the values that were written.
TEST_F(WireBytes, OfAUsersStructContainTheWrittenValues) {
  const auto message = test::userStruct();

  UserReader reader(message);
  const auto spectrum = reader.getRoot<wire::Float64Array>();

  EXPECT_EQ(spectrum.getAddress(), 0x01020304);
  ASSERT_EQ(spectrum.getValue().size(), test::kHardDoubles.size());
  for (unsigned i = 0; i < test::kHardDoubles.size(); ++i) {
    EXPECT_EQ(std::bit_cast<std::uint64_t>(spectrum.getValue()[i]),
              std::bit_cast<std::uint64_t>(test::kHardDoubles[i]));
  }
}

}  // namespace
