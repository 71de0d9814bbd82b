// SPDX-License-Identifier: MIT
// Frames: builds frames as routers send them.
//
// Threads  any.
#pragma once

#include <capnp/message.h>
#include <capnp/serialize.h>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "schema/router.capnp.h"

namespace mpf::test {

using Bytes = std::vector<std::uint8_t>;
using Fill = std::function<void(wire::Item::Builder)>;
using FillMessage = std::function<void(wire::Envelope::Builder)>;

inline Bytes bytesOf(capnp::MessageBuilder& message) {
  const auto words = capnp::messageToFlatArray(message);
  const auto bytes = words.asBytes();
  return {bytes.begin(), bytes.end()};
}

// Builds a frame of these items. `segmentWords`: the size of each segment, for a frame of several
// segments.
inline Bytes frameOf(const std::vector<Fill>& items,
                     capnp::uint segmentWords = capnp::SUGGESTED_FIRST_SEGMENT_WORDS) {
  capnp::MallocMessageBuilder message(segmentWords,
                                      segmentWords == capnp::SUGGESTED_FIRST_SEGMENT_WORDS
                                          ? capnp::SUGGESTED_ALLOCATION_STRATEGY
                                          : capnp::AllocationStrategy::FIXED_SIZE);
  auto list = message.initRoot<wire::Frame>().initItems(static_cast<capnp::uint>(items.size()));
  for (capnp::uint at = 0; at < list.size(); ++at) items[at](list[at]);
  return bytesOf(message);
}

inline Fill ping(std::uint64_t stamp) {
  return [stamp](wire::Item::Builder item) { item.initPing().setStamp(stamp); };
}

// The greeting of MPF's own router; `change` may modify it.
inline Fill greeting(const std::function<void(wire::Greeting::Builder)>& change = [](auto) {}) {
  return [change](wire::Item::Builder item) {
    auto greeting = item.initGreeting();
    greeting.setProtocolMajor(wire::PROTOCOL_MAJOR);
    greeting.setProtocolMinor(wire::PROTOCOL_MINOR);
    greeting.setRouter("by hand");
    greeting.setIncarnation(1);
    greeting.setMaxFrameBytes(std::uint64_t{1} << 26);
    greeting.setMaxMessageBytes(std::uint64_t{1} << 25);
    greeting.setDeadTimeMs(60'000);
    greeting.setMaxClients(16000);
    change(greeting);
  };
}

inline Bytes joined(std::initializer_list<Bytes> parts) {
  Bytes all;
  for (const auto& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

}  // namespace mpf::test
