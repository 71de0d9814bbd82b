// SPDX-License-Identifier: MIT
// MessageOf<T>: a handle that owns one message whose type is T and whose body is valid.
//
//   mpf::MessageOf message(mpf::Int32{.address = 3, .value = 5});    // or Int32Message({...})
//   auto array = mpf::Int32ArrayMessage::allocValue(1000);           // 1000 elements on the heap
//   std::ranges::fill(array.value(), 7);
//   if (auto typed = mpf::Int32Message::tryFrom(std::move(received))) use((*typed)->value);
//
//   MessageOf<T> = Message, and
//     * ->                                 the fields of T
//     value()                              the elements           arrays only
//     getLength, setLength, getMaxLength   number of elements     Int32Array, Float64Array
//     getSize, setSize, getMaxSize         number of bytes        Char8Array, User
//
// A moved-from MessageOf<T> is empty: only assignment, destruction and the test for emptiness
// (operator bool) are allowed.
//
// Threads  as Message: one thread at a time uses a handle.
// Trust    as Message: the array length is the one that was checked when the message was received.
// Source   manual, "Char8ArrayMessage", "Int32ArrayMessage", "Float64ArrayMessage".
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <utility>

#include <mpf/message.h>

namespace mpf {

template <MessageBody T>
class MessageOf : public Message {
 public:
  using Body = T;

  // A scalar with the given fields, or with all fields 0. The body is inside the handle.
  MessageOf() noexcept
    requires ScalarBody<T>
      : MessageOf(T{}) {}
  explicit MessageOf(const T& fields) noexcept
    requires ScalarBody<T>
      : Message(copyInline(T::kType, std::as_bytes(std::span(&fields, 1)))) {
    static_assert(sizeof(T) <= kInlineBytes);
  }

  // Allocates an array of n elements on the heap: fields 0, elements not initialised. To build an
  // array in the memory that is shared with the peer, use MessageClient::alloc() or
  // MessageServer::allocReplyMessage().
  //   throws  std::bad_alloc; std::length_error when n is above 2^32 - 1
  [[nodiscard]] static MessageOf allocValue(std::size_t n)
    requires ArrayBody<T>
  {
    if (n > UINT32_MAX) refuseLength(T::kType, n, UINT32_MAX);
    return inBuffer(allocateHeapBody(bytesFor(n)), n);
  }
  // [bytes] The size of the body of an array of n elements, to be requested from a lender.
  [[nodiscard]] static constexpr std::size_t bytesFor(std::size_t n) noexcept
    requires ArrayBody<T>
  {
    return sizeof(T) + n * sizeof(typename T::Element);
  }
  // As allocValue(), in memory of a lender, of which the message becomes the owner.
  //   throws  std::length_error when n elements do not fit; the lender has its memory back then
  [[nodiscard]] static MessageOf inBuffer(BodyBytes buffer, std::size_t n)
    requires ArrayBody<T>
  {
    if (buffer.capacity >= sizeof(T)) {
      const T fields{};
      std::memcpy(buffer.data, &fields, sizeof fields);
      buffer.size = sizeof(T);
    }
    MessageOf message(adopt(T::kType, buffer), Known{});
    if (!message.isSound()) refuseLength(T::kType, n, 0);
    message.setCount(n);
    return message;
  }
  // Moves `message` into a handle of type T. Returns nullopt, with `message` unchanged, when it has
  // another type or its body is invalid.
  [[nodiscard]] static std::optional<MessageOf> tryFrom(Message&& message) noexcept {
    if (message.tryAs<T>() == nullptr) return std::nullopt;
    return MessageOf(std::move(message), Known{});
  }

  // The fields, in place. Undefined for an empty handle. Do not write to `length` of an array.
  [[nodiscard]] T& operator*() noexcept { return *reinterpret_cast<T*>(data()); }
  [[nodiscard]] const T& operator*() const noexcept { return *reinterpret_cast<const T*>(data()); }
  [[nodiscard]] T* operator->() noexcept { return &**this; }
  [[nodiscard]] const T* operator->() const noexcept { return &**this; }

  // The elements of the array, in place: a std::span that is valid until the handle is moved, sent
  // or destroyed, or the length changes.
  [[nodiscard]] auto value() noexcept
    requires ArrayBody<T>
  {
    return this->template valueAs<T>();
  }
  [[nodiscard]] auto value() const noexcept
    requires ArrayBody<T>
  {
    return this->template valueAs<T>();
  }

  // Numeric arrays: the number of elements. setLength() keeps the elements that fit and does not
  // initialise new ones.
  //   throws  setLength(): std::length_error above getMaxLength(); the message is unchanged then
  [[nodiscard]] std::size_t getLength() const noexcept
    requires CountedInElements<T>
  {
    return arrayLength();
  }
  [[nodiscard]] std::size_t getMaxLength() const noexcept
    requires CountedInElements<T>
  {
    return this->template maxLength<T>();
  }
  void setLength(std::size_t length)
    requires CountedInElements<T>
  {
    setCount(length);
  }

  // Char8Array and User: the number of bytes. setSize() keeps the bytes that fit and does not
  // initialise new ones.
  //   throws  setSize(): std::length_error above getMaxSize(); the message is unchanged then
  [[nodiscard]] std::size_t getSize() const noexcept
    requires CountedInBytes<T>
  {
    return arrayLength();
  }
  [[nodiscard]] std::size_t getMaxSize() const noexcept
    requires CountedInBytes<T>
  {
    return this->template maxLength<T>();
  }
  void setSize(std::size_t size)
    requires CountedInBytes<T>
  {
    setCount(size);
  }

 private:
  struct Known {};
  MessageOf(Message&& message, Known) noexcept : Message(std::move(message)) {}

  void setCount(std::size_t count) {
    if (!this->template trySetArrayLength<T>(count))
      refuseLength(T::kType, count, this->template maxLength<T>());
  }
};

// One alias for each type of <mpf/message_types.h>.
using ConnectMessage = MessageOf<Connect>;
using Int32Message = MessageOf<Int32>;
using Int32ArrayMessage = MessageOf<Int32Array>;
using Float64Message = MessageOf<Float64>;
using Float64ArrayMessage = MessageOf<Float64Array>;
using Char8ArrayMessage = MessageOf<Char8Array>;
using SerialConfigMessage = MessageOf<SerialConfig>;
using OutOfBandMessage = MessageOf<OutOfBand>;
using RequestFateMessage = MessageOf<RequestFate>;
using UserMessage = MessageOf<User>;

}  // namespace mpf
