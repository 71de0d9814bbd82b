// SPDX-License-Identifier: MIT
// Reads all fields of the frames in an input. The first byte of the input sets the size of the
// parts in which the rest arrives.
#include <algorithm>
#include <capnp/message.h>
#include <cstring>
#include <kj/exception.h>
#include <stdexcept>

#include "router/transport/frame_reader.h"
#include "router/transport/kj_text.h"
#include "schema/conversion.h"
#include "tests/fuzz/fuzzer.h"
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

}  // namespace

void play(std::span<const std::uint8_t> input) try {
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
      for (const auto item : frame->getRoot<wire::Frame>().getItems()) look(item);
    }
  }
} catch (const std::runtime_error&) {  // NOLINT(bugprone-empty-catch): ends the connection
} catch (const kj::Exception&) {       // NOLINT(bugprone-empty-catch): ends the connection
}

}  // namespace mpf::test
