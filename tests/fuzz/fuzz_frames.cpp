// SPDX-License-Identifier: MIT
// Reads all fields of the frames in an input. The first byte of the input sets the size of the
// parts in which the rest arrives.
#include <algorithm>
#include <capnp/message.h>
#include <cstdlib>
#include <cstring>
#include <kj/exception.h>
#include <stdexcept>

#include "router/transport/frame_reader.h"
#include "router/transport/kj_text.h"
#include "router/transport/plain_item.h"
#include "schema/conversion.h"
#include "tests/fuzz/fuzzers.h"
#include "tests/fuzz/talk.h"

namespace mpf::test {
namespace {

constexpr std::uint64_t kMaxFrameBytes = std::uint64_t{1} << 20;
constexpr std::size_t kMaxMessageBytes = std::size_t{1} << 16;

void look(wire::Envelope::Reader envelope) {
  ConversionError error;
  if (const auto message = tryFromWire(envelope, {kMaxMessageBytes}, error)) lookAt(*message);
  else static_cast<void>(envelope.totalSize());
}

void look(wire::Item::Reader item) {
  using router::displayText;
  switch (item.which()) {
    case wire::Item::GREETING:
      static_cast<void>(displayText(item.getGreeting().getRouter()));
      static_cast<void>(displayText(item.getGreeting().getProgram()));
      for ([[maybe_unused]] const auto location : item.getGreeting().getLocations()) {
      }
      return;
    case wire::Item::FAREWELL:
      return static_cast<void>(displayText(item.getFarewell().getReason()));
    case wire::Item::BIND:
      return static_cast<void>(router::toStd(item.getBind().getServer()));
    case wire::Item::SERVER:
      return static_cast<void>(displayText(item.getServer().getReason()));
    case wire::Item::REFUSE:
      return static_cast<void>(displayText(item.getRefuse().getReason()));
    case wire::Item::FATE:
      return static_cast<void>(displayText(item.getFate().getReason()));
    case wire::Item::REQUEST:
      return look(item.getRequest().getMessage());
    case wire::Item::REPLY:
      return look(item.getReply().getMessage());
    default:
      return;
  }
}

// An item that is read in place has what Cap'n Proto's reader finds.
void compare(const router::PlainItem& plain, wire::Item::Reader item) {
  ConversionError error;
  const auto envelope =
      plain.isRequest ? item.getRequest().getMessage() : item.getReply().getMessage();
  const auto message = tryFromWire(envelope, {kMaxMessageBytes}, error);
  const bool isSame = message && message->getType() == plain.message.getType() &&
                      std::ranges::equal(message->body(), plain.message.body()) &&
                      message->getClientType() == plain.message.getClientType() &&
                      message->getClientExtra() == plain.message.getClientExtra() &&
                      message->getTimeStampNs() == plain.message.getTimeStampNs();
  const auto hasNumbersOf = [&](auto carrier) {
    return plain.client == carrier.getClient() && plain.requestId == carrier.getRequestId();
  };
  const bool hasSameNumbers = plain.isRequest
                                  ? hasNumbersOf(item.getRequest())
                                  : hasNumbersOf(item.getReply()) &&
                                        plain.isFirst == item.getReply().getIsFirst() &&
                                        plain.message.getMissed() == item.getReply().getMissed();
  if (!isSame || !hasSameNumbers) std::abort();
}

void lookAtPlainItems(capnp::MessageReader& frame, capnp::List<wire::Item>::Reader items) {
  if (frame.getSegment(1) != nullptr) return;
  const auto plain = router::PlainFrame::tryOpen(frame.getSegment(0));
  if (!plain) return;
  MessageRun together;
  for (capnp::uint at = 0; at < items.size(); ++at) {
    router::PlainItem item;
    if (plain->tryRead(at, item)) compare(item, items[at]);
    const auto run = plain->readItems(at, items.size(), together);
    for (std::size_t index = 0; index < together.size(); ++index)
      compare(run[index], items[at + static_cast<capnp::uint>(index)]);
  }
}

}  // namespace

void playFrames(std::span<const std::uint8_t> input) try {
  if (input.empty()) return;
  const std::size_t part = std::size_t{input.front()} * 4 + 1;
  router::FrameReader reader(kMaxFrameBytes);
  for (auto rest = input.subspan(1); !rest.empty();) {
    auto room = reader.room();
    const auto bytes = rest.first(std::min({part, room.size(), rest.size()}));
    std::memcpy(room.begin(), bytes.data(), bytes.size());
    reader.filled(bytes.size());
    rest = rest.subspan(bytes.size());
    while (auto* frame = reader.tryNext()) {
      const auto items = frame->getRoot<wire::Frame>().getItems();
      lookAtPlainItems(*frame, items);
      for (const auto item : items) look(item);
    }
  }
} catch (const std::runtime_error&) {  // NOLINT(bugprone-empty-catch): ends the connection
} catch (const kj::Exception&) {       // NOLINT(bugprone-empty-catch): ends the connection
}

}  // namespace mpf::test
