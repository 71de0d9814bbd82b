// SPDX-License-Identifier: MIT
// answerOtherTypes(): replies to requests of the types that a server does not handle.
#pragma once

#include <concepts>
#include <tuple>
#include <type_traits>
#include <utility>

#include <mpf/message_server.h>

namespace mpf {

template <class T>
concept HasStatus = std::same_as<decltype(T::status), std::int32_t>;

// Sets handlers for all types except `Known`, which reply with status -1. The reply to a
// SerialConfig, which has no status, is an Int32, as for serial servers. Other types without a
// status have no handler, so the server refuses them.
//   note  called with the type of each such request, on the server's thread
template <class... Known, class Note>
void answerOtherTypes(MessageServer& server, Note note) {
  const auto answer = [&]<class T>(std::type_identity<T>) {
    constexpr bool kIsKnown = (std::same_as<T, Known> || ...);
    if constexpr (std::same_as<T, SerialConfig> && !kIsKnown) {
      server.on<T>([&server, note](MessageOf<T>&& request) mutable {
        auto reply = server.allocReplyMessage<Int32>(request);
        reply->status = -1;
        static_cast<void>(server.reply(std::move(reply)));
        note(T::kType);
      });
    } else if constexpr (HasStatus<T> && !kIsKnown) {
      server.on<T>([note](MessageOf<T>& request) mutable {
        request->status = -1;
        note(T::kType);
      });
    }
  };
  [&]<class... T>(std::type_identity<std::tuple<T...>>) {
    (answer(std::type_identity<T>{}), ...);
  }(std::type_identity<MessageTypes>{});
}

}  // namespace mpf
