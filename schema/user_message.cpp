// SPDX-License-Identifier: MIT
#include <mpf/user_message.h>

namespace mpf {

namespace {

template <class Byte>
auto wordsOf(std::span<Byte> bytes) {
  using Word = std::conditional_t<std::is_const_v<Byte>, const capnp::word, capnp::word>;
  return kj::ArrayPtr<Word>(reinterpret_cast<Word*>(bytes.data()),
                            bytes.size() / sizeof(capnp::word));
}

// The memory after the segment table, filled with zeroes.
kj::ArrayPtr<capnp::word> segmentOf(UserMessage& message) {
  message.setSize(message.getMaxSize() / sizeof(capnp::word) * sizeof(capnp::word));
  const auto bytes = message.value();
  KJ_REQUIRE(bytes.size() >= 2 * sizeof(capnp::word),
             "a user message needs room for at least 16 bytes");
  std::memset(bytes.data(), 0, bytes.size());
  return wordsOf(bytes.subspan(sizeof(capnp::word)));
}

}  // namespace

UserBuilder::UserBuilder(UserMessage message)
    : message_(std::move(message)), builder_(segmentOf(message_)) {}

UserMessage UserBuilder::finish() && {
  const auto segments = builder_.getSegmentsForOutput();
  KJ_REQUIRE(segments.size() == 1, "finish() of a user message before initRoot()");
  const auto words = static_cast<std::uint32_t>(segments[0].size());
  // number of segments less one, then the words of the segment; little-endian
  std::array<std::uint8_t, 8> table{};
  for (std::size_t i = 0; i < 4; ++i) table[4 + i] = static_cast<std::uint8_t>(words >> 8 * i);
  std::memcpy(message_.value().data(), table.data(), table.size());
  message_.setSize((words + std::size_t{1}) * sizeof(capnp::word));
  return std::move(message_);
}

UserMessage toUserMessage(capnp::MessageBuilder& builder) {
  const auto words = capnp::messageToFlatArray(builder);
  const auto bytes = words.asBytes();
  auto message = UserMessage::allocValue(bytes.size());
  std::memcpy(message.value().data(), bytes.begin(), bytes.size());
  return message;
}

UserReader::UserReader(const UserMessage& message, capnp::ReaderOptions limits)
    : capnp::FlatArrayMessageReader(wordsOf(message.value()), limits) {}

}  // namespace mpf
