// SPDX-License-Identifier: MIT
#include "tests/fuzz/talk.h"

#include <capnp/message.h>
#include <sanitizer/asan_interface.h>

#include <mpf/message_of.h>

#include "schema/conversion.h"
#include "schema/json.h"
#include "schema/text.h"

namespace mpf::test {
namespace {

// The rest of the last page of a link, after its rings. No code may access it.
std::span<const std::byte> behind(Link& link) {
  const auto* begin =
      reinterpret_cast<const std::byte*>(&link.control()) - layout::kLinkControlOffset;
  const auto bytes = link.header().totalBytes;
  const auto pages = (bytes + layout::kPageBytes - 1) / layout::kPageBytes * layout::kPageBytes;
  return {begin + bytes, pages - bytes};
}

}  // namespace

LinkSend sendArray(MessageLink& link, std::uint32_t requestId, std::size_t bytes) {
  const auto size = Char8ArrayMessage::bytesFor(bytes);
  const auto body = [&] {
    const BiasedLock::Guard lock(link.lock());
    return link.tryAllocateLocked(size);
  }();
  Message message =
      Char8ArrayMessage::inBuffer(body.data != nullptr ? body : allocateHeapBody(size), bytes);
  Envelope envelope{.type = static_cast<std::uint16_t>(message.getType()), .requestId = requestId};
  const BiasedLock::Guard lock(link.lock());
  return link.trySendLocked(link.link(), [&] { return envelope; }, message, {});
}

void lookAt(const Message& message) {
  static_cast<void>(print(message));
  static_cast<void>(toJson(message).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  capnp::MallocMessageBuilder builder;
  ConversionError error;
  static_cast<void>(tryToWire(message, builder.initRoot<wire::Envelope>(), {}, error));
}

Talk::Talk(std::unique_ptr<Link> link, FanOutPool* fanOut)
    : channel_(MessageLink::make(std::move(link), std::make_shared<BiasedLock>())),
      fanOut_(fanOut) {
  [[maybe_unused]] const auto unused = behind(channel_->link());
  ASAN_POISON_MEMORY_REGION(unused.data(), unused.size());
}

Talk::~Talk() {
  [[maybe_unused]] const auto unused = behind(channel_->link());
  ASAN_UNPOISON_MEMORY_REGION(unused.data(), unused.size());
}

void Talk::turn(std::uint64_t value) {
  constexpr int kMost = 8;  // messages of a turn
  auto& link = channel_->link();
  if (isOver_) return;
  for (int i = 0; i < kMost && tryTakeOne(value >> i); ++i) {
  }
  if (link.peerState() != layout::LinkState::open || link.isLost())
    link.setState(layout::LinkState::closed);
  sendArray(*channel_, static_cast<std::uint32_t>(value), value % 2048);
  if (fanOut_ != nullptr) publish(value);
  static_cast<void>(link.outgoing().isTaken(value % 8));
  if (value % 2 != 0) link.watch(true);
  else Link::execute(link.unwatch());
  link.notifyPeer();
}

bool Talk::tryFinish(const Envelope& envelope, Message& message) {
  if (!MessageLink::isShort(envelope.body())) {
    MessageLink::Finish finish{};
    message = channel_->finishLong(envelope.body(), {}, finish);
    return finish == MessageLink::Finish::message;
  }
  message = channel_->finishShort(envelope, {}, 0);
  return true;
}

// Returns false when no message waits, or when invalid data ends the talk.
bool Talk::tryTakeOne(std::uint64_t choice) {
  if (!channel_->hasMessage()) return false;
  Envelope envelope;
  const bool isValid = channel_->tryBegin(envelope);
  if (isValid && choice % 4 == 3) {
    channel_->discard(envelope.body());
    return true;
  }
  Message message;
  isOver_ = !isValid || !tryFinish(envelope, message);
  if (isOver_) return false;
  lookAt(message);
  if (choice % 4 == 0) sendBack(envelope, message);
  else if (choice % 4 == 1) kept_ = std::move(message);
  return true;
}

// The client may return this chunk, or others that it never had, at any time.
void Talk::publish(std::uint64_t value) {
  constexpr std::uint32_t kMaxBorrowed = 3;
  const auto bytes = value % 2048;
  const auto chunk = fanOut_->tryAlloc(bytes);
  Envelope envelope{.type = static_cast<std::uint16_t>(MessageType::char8Array),
                    .requestId = static_cast<std::uint32_t>(value % 4)};
  {
    const BiasedLock::Guard lock(channel_->lock());
    static_cast<void>(channel_->link().trySendFanOut(envelope, chunk, bytes, {}, kMaxBorrowed));
  }
  if (chunk) chunk->drop();
}

void Talk::sendBack(Envelope envelope, Message& message) {
  envelope.flags = layout::kSlotFirstReply;
  const BiasedLock::Guard lock(channel_->lock());
  static_cast<void>(
      channel_->trySendLocked(channel_->link(), [&] { return envelope; }, message, {}));
}

}  // namespace mpf::test
