// SPDX-License-Identifier: MIT
// ValueHandler: the callback of a client for replies of one scalar type.
//
// Threads  the dispatcher's thread; the handler is set before the client is bound.
#pragma once

#include <cstddef>
#include <functional>
#include <span>

#include <mpf/message.h>

namespace mpf {

struct ValueHandler {
  MessageType type = MessageType::none;  // none: there is no handler
  std::size_t size = 0;  // [bytes] of a value
  std::function<void(std::span<const std::byte> values, const Message& first)> callback;
};

}  // namespace mpf
