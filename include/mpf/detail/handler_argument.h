// SPDX-License-Identifier: MIT
// HandlerArgument: what MessageServer::on<T>() calls a handler with.
//
// Internal: installed because <mpf/message_server.h> uses it. Programs must not: any release may
// change or remove it.
//
//   HandlerArgument<T, Handler>   T&, MessageOf<T>&, MessageOf<T>&& or std::span<T>; void if the
//                                 handler takes none of them
//
// A handler that takes T or const T& could be called with a T&, but what it changes would be lost,
// and the client would get its own value back: its argument is void, too. This is only known of
// handlers whose operator() is not a template: the body of a generic lambda is compiled for each
// type that it is asked about.
#pragma once

#include <cstddef>
#include <span>
#include <type_traits>

#include <mpf/message_of.h>

namespace mpf::detail {

// The type of the only parameter of a function or of operator(); void if there are more or none, or
// if operator() is a template or overloaded.
template <class F>
struct ParameterOf {
  using Type = void;
};
template <class Result, class Parameter, bool isNoexcept>
struct ParameterOf<Result (*)(Parameter) noexcept(isNoexcept)> {
  using Type = Parameter;
};
template <class Result, class Class, class Parameter, bool isNoexcept>
struct ParameterOf<Result (Class::*)(Parameter) noexcept(isNoexcept)> {
  using Type = Parameter;
};
template <class Result, class Class, class Parameter, bool isNoexcept>
struct ParameterOf<Result (Class::*)(Parameter) const noexcept(isNoexcept)> {
  using Type = Parameter;
};
template <class F>
  requires requires { &F::operator(); }
struct ParameterOf<F> : ParameterOf<decltype(&F::operator())> {};

// Whether T is a notification for the callback of a client: a server sends it, and handles none.
template <class T>
inline constexpr bool kIsNotification =
    std::is_same_v<T, Connect> || std::is_same_v<T, RequestFate>;

// Whether a handler with this parameter cannot change the request that is sent as the reply.
template <class T, class Parameter>
inline constexpr bool kLosesChanges =
    std::is_same_v<std::remove_const_t<Parameter>, T> || std::is_same_v<Parameter, const T&> ||
    std::is_same_v<Parameter, const Message&> || std::is_same_v<Parameter, const MessageOf<T>&> ||
    std::is_same_v<std::remove_cvref_t<Parameter>, std::span<const T>>;

// The order decides for a handler that takes several of them.
template <class T, class Handler>
consteval auto handlerArgument() {
  if constexpr (kLosesChanges<T, typename ParameterOf<Handler>::Type>)
    return std::type_identity<void>{};
  else if constexpr (std::is_invocable_v<Handler&, T&>) return std::type_identity<T&>{};
  else if constexpr (ScalarBody<T> && std::is_invocable_v<Handler&, std::span<T>>)
    return std::type_identity<std::span<T>>{};
  else if constexpr (std::is_invocable_v<Handler&, MessageOf<T>&>)
    return std::type_identity<MessageOf<T>&>{};
  else if constexpr (std::is_invocable_v<Handler&, MessageOf<T>>)
    return std::type_identity<MessageOf<T>&&>{};
  else return std::type_identity<void>{};
}
template <class T, class Handler>
using HandlerArgument = typename decltype(handlerArgument<T, Handler>())::type;

// Whether a function pointer or a std::function is empty; false for other handlers.
template <class Handler>
[[nodiscard]] bool isEmptyHandler(const Handler& handler) noexcept {
  if constexpr (std::is_assignable_v<Handler&, std::nullptr_t> &&
                requires { static_cast<bool>(handler == nullptr); })
    return handler == nullptr;
  else return false;
}

}  // namespace mpf::detail
