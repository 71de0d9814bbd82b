// SPDX-License-Identifier: MIT
// The items that a client router sends.
//
// Threads  any.
#pragma once

#include <string>

#include "tests/router/frames.h"

namespace mpf::test {

inline Fill bind(std::uint32_t binding, const std::string& server = "echo",
                 std::int32_t location = 1) {
  return [=](wire::Item::Builder item) {
    auto bind = item.initBind();
    bind.setBinding(binding);
    bind.setLocation(location);
    bind.setServer(server);
  };
}

inline Fill open(std::uint32_t client, std::uint32_t binding, std::uint64_t incarnation,
                 std::uint32_t window = 1u << 20) {
  return [=](wire::Item::Builder item) {
    auto open = item.initOpen();
    open.setClient(client);
    open.setBinding(binding);
    open.setIncarnation(incarnation);
    open.setWindow(window);
  };
}

inline Fill close(std::uint32_t client) {
  return [=](wire::Item::Builder item) { item.setClose(client); };
}

inline Fill requestOf(std::uint32_t client, std::uint32_t id, const FillMessage& fill) {
  return [=](wire::Item::Builder item) {
    auto request = item.initRequest();
    request.setClient(client);
    request.setRequestId(id);
    fill(request.initMessage());
  };
}

inline Fill request(std::uint32_t client, std::uint32_t id, std::int32_t value = 0) {
  return requestOf(client, id, [value](auto message) { message.initInt32().setValue(value); });
}

inline Fill credit(std::uint32_t client, std::uint32_t bytes) {
  return [=](wire::Item::Builder item) {
    item.initCredit().setClient(client);
    item.getCredit().setBytes(bytes);
  };
}

}  // namespace mpf::test
