// SPDX-License-Identifier: MIT
// Handlers: those that a program has set with MessageServer::on(), by message type.
//
// A handler may set others, also in its own place: what it replaces exists until the outermost
// handler has returned.
//
// Threads  the server's thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include <mpf/message.h>
#include <mpf/message_types.h>

namespace mpf {

using HandleMessage = std::function<void(Message&& request)>;
// Changes the values, which are then sent as the replies; they lie one after the other.
using HandleRun = std::function<void(std::span<std::byte> values)>;

class Handlers {
 public:
  //   forRun  for waiting requests of one client that are handled together; may be empty
  void set(MessageType type, HandleMessage forMessage, HandleRun forRun = {}) {
    auto made = std::make_unique<Handler>(std::move(forMessage), std::move(forRun));
    replaced_.reserve(replaced_.size() + 1);  // nothing fails after the exchange
    auto replaced = std::exchange(handlers_.at(static_cast<std::size_t>(type)), std::move(made));
    if (calls_ != 0) replaced_.push_back(std::move(replaced));
  }

  void clear() noexcept { handlers_ = {}; }

  // Return nullptr if there is no handler for this message type.
  [[nodiscard]] const HandleMessage* find(std::uint16_t type) const noexcept {
    const auto* const handler = handlerOf(type);
    return handler != nullptr ? &handler->forMessage : nullptr;
  }
  [[nodiscard]] const HandleRun* findForRun(std::uint16_t type) const noexcept {
    const auto* const handler = handlerOf(type);
    return handler != nullptr && handler->forRun ? &handler->forRun : nullptr;
  }

  // Whether a handler is being called.
  [[nodiscard]] bool isCalling() const noexcept { return calls_ != 0; }

  // Exists while a handler is called. Calls may be nested.
  class Call {
   public:
    explicit Call(Handlers& handlers) noexcept : handlers_(handlers) { ++handlers_.calls_; }
    ~Call() {
      if (--handlers_.calls_ == 0) handlers_.replaced_.clear();
    }
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;

   private:
    Handlers& handlers_;
  };

 private:
  struct Handler {
    HandleMessage forMessage;
    HandleRun forRun;
  };

  [[nodiscard]] const Handler* handlerOf(std::uint16_t type) const noexcept {
    return type < handlers_.size() ? handlers_[type].get() : nullptr;
  }

  std::array<std::unique_ptr<Handler>, std::tuple_size_v<MessageTypes> + 1> handlers_;
  std::vector<std::unique_ptr<Handler>> replaced_;
  int calls_ = 0;
};

}  // namespace mpf
