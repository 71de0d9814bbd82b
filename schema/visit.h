// SPDX-License-Identifier: MIT
// withType(), visitFields(): run code for the type of a message, or for each of its fields, using
// the descriptions in message_types.h.
#pragma once

#include <span>
#include <string_view>
#include <tuple>
#include <type_traits>

#include <mpf/message.h>

namespace mpf {

// Calls act(std::type_identity<T>{}) for the type with this number and returns its result; false
// for an unknown number.
template <class Act>
bool withType(MessageType type, Act&& act) {
  return [&]<class... T>(std::type_identity<std::tuple<T...>>) {
    bool result = false;
    static_cast<void>(
        ((T::kType == type && (static_cast<void>(result = act(std::type_identity<T>{})), true)) ||
         ...));
    return result;
  }(std::type_identity<MessageTypes>{});
}

namespace detail {

template <class Body, class Value, class Visit>
void visitField(const Body& body, const Field<Body, Value>& field, Visit&& visit) {
  visit(field.name, body.*field.member);
}
template <class Body, std::size_t room, class Visit>
void visitField(const Body& body, const BytesField<Body, room>& field, Visit&& visit) {
  const auto used = std::clamp(body.*field.used, 0, static_cast<std::int32_t>(room));
  visit(field.name, std::string_view((body.*field.member).data(), static_cast<std::size_t>(used)));
}

}  // namespace detail

// Calls visit(name, value) for each field of a message and then for the elements of an array.
//
//   value    std::int32_t, std::uint32_t, std::uint64_t, double, char, ConnectStatus, Fate,
//            std::string_view (the used bytes of a short string), std::span<const Element>
//   returns  false for an unknown type or an invalid body
//   trust    fields are visited in a private copy, elements in the memory of the message
template <class Visit>
bool visitFields(const Message& message, Visit&& visit) {
  return withType(message.getType(), [&]<class T>(std::type_identity<T>) {
    const T* const fields = message.tryAs<T>();
    if (fields == nullptr) return false;
    const T copy = *fields;
    std::apply([&](const auto&... field) { (detail::visitField(copy, field, visit), ...); },
               T::fields());
    if constexpr (ArrayBody<T>) visit(kValueName, message.valueAs<T>());
    return true;
  });
}

}  // namespace mpf
