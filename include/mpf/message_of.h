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
// A moved-from or sent MessageOf<T> is empty: only assignment, destruction and the test for
// emptiness (operator bool) are allowed.
//
// The memory of a body never grows: getMaxLength() and getMaxSize() are fixed when the body is
// allocated. If a reply has more elements than its request, the server allocates the
// reply with MessageServer::allocReplyMessage().
//
// Threads  as Message: one thread at a time uses a handle.
// Throws   allocValue(), bytesFor(), inBuffer(), setLength() and setSize(); no other function.
// Trust    as Message: the length of an array follows from the size of its body.
// Source   manual, "Char8ArrayMessage", "Int32ArrayMessage", "Float64ArrayMessage". freeValue() has
//          no counterpart: the destructor of the handle frees the elements.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <utility>

#include <mpf/message.h>

namespace mpf {

// T is a struct of <mpf/message_types.h>. A MessageOf<T> can be moved into a Message, for example
// into a queue; tryFrom() is the way back.
template <MessageBody T>
class MessageOf : public Message {
 public:
  // The struct of the fields, for templates.
  using Body = T;

  // A scalar with the given fields, or with all fields 0. The body is inside the handle: nothing is
  // allocated. clientType and clientExtra are 0.
  MessageOf() noexcept
    requires ScalarBody<T>
      : MessageOf(T{}) {}
  explicit MessageOf(const T& fields) noexcept
    requires ScalarBody<T>
  {
    static_assert(sizeof(T) <= kInlineBytes);
    setFields(T::kType, fields);
  }

  // Allocates an array of n elements on the heap: fields 0, elements not initialised, and room for
  // exactly n. Sending it copies it once. To build an array in the memory that is shared with the
  // peer, use MessageClient::alloc() or MessageServer::allocReplyMessage().
  //   n       0 is valid; ServerOptions::maxMessageBytes limits the arrays that can be sent
  //   throws  std::bad_alloc; std::length_error when n is above 2^32 - 1
  [[nodiscard]] static MessageOf allocValue(std::size_t n)
    requires ArrayBody<T>
  {
    return inBuffer(allocateHeapBody(bytesFor(n)), n);
  }
  // [bytes] The size of the body of an array of n elements, fields included, to be requested from a
  // lender.
  //   throws  std::length_error when n is above 2^32 - 1
  [[nodiscard]] static constexpr std::size_t bytesFor(std::size_t n)
    requires ArrayBody<T>
  {
    if (n > UINT32_MAX) refuseLength(T::kType, n, UINT32_MAX);
    return sizeof(T) + n * sizeof(typename T::Element);
  }
  // As allocValue(), in memory of a lender, of which the message becomes the owner. The array has
  // room for as many elements as buffer.capacity allows, which may be more than n.
  //   buffer  at least bytesFor(n) bytes, aligned to 8 bytes
  //   throws  std::length_error when n elements do not fit or the memory is misaligned; the lender
  //           has its memory back then
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
  // Moves `message` into a handle of type T, with its clientType, clientExtra and route. Copies no
  // out-of-line body. `message` is empty then.
  //   returns  nullopt, with `message` unchanged, when it has another type, is empty or its body is
  //            invalid
  [[nodiscard]] static std::optional<MessageOf> tryFrom(Message&& message) noexcept {
    if (message.tryAs<T>() == nullptr) return std::nullopt;
    return MessageOf(std::move(message), Known{});
  }

  // The fields, in place, valid until the handle is moved, sent or destroyed. Undefined for an
  // empty handle. Do not write to `length` of an array: setLength() and setSize() do. The sender of
  // a message whose body is in shared memory may change fields at any time: copy a field before you
  // check it.
  [[nodiscard]] T& operator*() noexcept { return *reinterpret_cast<T*>(data()); }
  [[nodiscard]] const T& operator*() const noexcept { return *reinterpret_cast<const T*>(data()); }
  [[nodiscard]] T* operator->() noexcept { return &**this; }
  [[nodiscard]] const T* operator->() const noexcept { return &**this; }

  // The elements of the array, in place: a std::span that is valid until the handle is moved, sent
  // or destroyed, or the length changes. Empty for an empty handle. New elements are not
  // initialised: write all of them before the message is sent.
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

  // Numeric arrays: the number of elements, and the number for which there is room: after
  // allocValue(n), n. setLength() keeps the elements that fit and does not initialise new ones; it
  // allocates nothing and may be called any number of times.
  //   returns  0 for an empty handle, from both getters
  //   throws   setLength(): std::length_error above getMaxLength(); the message is unchanged then
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

  // Char8Array and User: the number of bytes of value(), without the fields, and the number for
  // which there is room. A text has no terminating zero unless the sender counts one. setSize()
  // keeps the bytes that fit and does not initialise new ones.
  //   returns  0 for an empty handle, from both getters
  //   throws   setSize(): std::length_error above getMaxSize(); the message is unchanged then
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
  // Selects the constructor for a message whose type is T; nothing is checked again.
  struct Known {};
  MessageOf(Message&& message, Known) noexcept : Message(std::move(message)) {}

  // setLength() and setSize().
  //   throws  std::length_error, which names the type, the length and the room
  void setCount(std::size_t count) {
    if (!this->template trySetArrayLength<T>(count))
      refuseLength(T::kType, count, this->template maxLength<T>());
  }
};

// One alias for each type of <mpf/message_types.h>, with the name that the manual gives to it;
// RequestFateMessage and UserMessage are additions.
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
