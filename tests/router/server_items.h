// SPDX-License-Identifier: MIT
// The items that a server router sends.
//
// Threads  any.
#pragma once

#include <string>

#include "tests/router/frames.h"

namespace mpf::test {

inline constexpr std::uint64_t kIncarnation = 77;

inline Fill server(std::uint32_t binding, wire::Server::State state,
                   std::uint64_t incarnation = kIncarnation) {
  return [=](wire::Item::Builder item) {
    auto server = item.initServer();
    server.setBinding(binding);
    server.setState(state);
    server.setIncarnation(incarnation);
    server.setQueueSize(10);
    server.setMaxOutstanding(20);
    server.setMaxMessageBytes(1u << 20);
    server.setHops(3);
    server.setReason("a reason of the rogue");
  };
}

inline Fill replyOf(std::uint32_t client, std::uint32_t id, const FillMessage& fill,
                    bool isFirst = true) {
  return [=](wire::Item::Builder item) {
    auto reply = item.initReply();
    reply.setClient(client);
    reply.setRequestId(id);
    reply.setIsFirst(isFirst);
    fill(reply.initMessage());
  };
}

inline Fill reply(std::uint32_t client, std::uint32_t id, bool isFirst, std::int32_t value = 0) {
  return replyOf(
      client, id, [value](auto message) { message.initInt32().setValue(value); }, isFirst);
}

inline Fill fate(std::uint32_t client, std::uint32_t id, std::uint16_t fate) {
  return [=](wire::Item::Builder item) {
    auto end = item.initFate();
    end.setClient(client);
    end.setRequestId(id);
    end.setFate(static_cast<wire::Fate>(fate));
  };
}

}  // namespace mpf::test
