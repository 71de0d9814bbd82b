// SPDX-License-Identifier: MIT
// PyMessage: what Python holds of one message. The classes of Python are made from the descriptions
// in <mpf/message_types.h>: mpf.Int32, mpf.Float64Array and so on.
//
//   PyMessage ─┬─ PyScalar<T>   the fields
//              └─ PyArray<T>    the fields, and the elements: those of an object of Python, or in
//                               place in a message that was received or loaned
//
// Threads  the thread that holds the GIL.
// Trust    fields are copied when a message is received; elements in shared memory are read-only,
//          and their number is the one that was checked.
#pragma once

#include <cstring>
#include <nanobind/nanobind.h>

#include <mpf/message_client.h>
#include <mpf/message_of.h>
#include <mpf/message_server.h>

#include "python/extension/gil.h"

namespace mpf::python {

namespace nb = nanobind;

inline constexpr const char* kWasSent = "the message was sent: its memory belongs to the receiver";

// Where messages are allocated: for a client, for a reply of a server, or for all of its clients.
class Allocator {
 public:
  explicit Allocator(MessageClient& client) : client_(&client) {}
  explicit Allocator(MessageServer& server) : server_(&server) {}
  Allocator(MessageServer& server, const Message& request) : server_(&server), request_(&request) {}

  template <ScalarBody T>
  [[nodiscard]] MessageOf<T> scalar() const {
    return request_ != nullptr ? server_->allocReplyMessage<T>(*request_) : MessageOf<T>();
  }
  template <ArrayBody T>
  [[nodiscard]] MessageOf<T> array(std::size_t length) const {
    if (client_ != nullptr) return client_->alloc<T>(length);
    return request_ != nullptr ? server_->allocReplyMessage<T>(*request_, length)
                               : server_->allocShared<T>(length);
  }

 private:
  MessageClient* client_ = nullptr;
  MessageServer* server_ = nullptr;
  const Message* request_ = nullptr;
};

class PyMessage {
 public:
  virtual ~PyMessage() = default;
  PyMessage() = default;
  PyMessage(PyMessage&&) = default;
  PyMessage& operator=(PyMessage&&) = delete;

  // Returns the message to send. Copies the elements, unless they are in a loaned message that no
  // object of Python refers to: that message itself is returned, and this object is empty then.
  [[nodiscard]] virtual Message toMessage(const Allocator& allocator) = 0;
  // Takes back a message of toMessage() that was not sent.
  virtual void restore(Message&& message) noexcept = 0;
  // The field `status`; 0 of types without it.
  [[nodiscard]] virtual std::int32_t status() const noexcept = 0;

  std::int64_t timeStampNs = 0;
  // A message with elements that was received or loaned; of a request that a server received, also
  // its route. Empty otherwise.
  Message handle;
};

template <class T>
std::int32_t statusOf(const T& fields) noexcept {
  if constexpr (requires { fields.status; }) {
    return fields.status;
  }
  return 0;
}

template <ScalarBody T>
class PyScalar final : public PyMessage {
 public:
  T fields{};

  Message toMessage(const Allocator& allocator) override {
    auto message = allocator.scalar<T>();
    *message = fields;
    return message;
  }
  void restore(Message&& /*message*/) noexcept override {}
  [[nodiscard]] std::int32_t status() const noexcept override { return statusOf(fields); }
};

template <ArrayBody T>
class PyArray final : public PyMessage {
 public:
  T fields{};  // `length` is not used
  // An object with a contiguous buffer of elements, whose size may change, for example that of a
  // bytearray. Null: they are in `handle`.
  nb::object values;
  bool isLoaned = false;  // writable, and may be sent without a copy
  bool isEmpty = false;  // it was sent without a copy
  std::int32_t exports = 0;  // objects of Python that refer to the elements in `handle`
  Py_ssize_t length = 0;  // elements in `handle`

  Message toMessage(const Allocator& allocator) override {
    if (isLoaned && exports == 0 && !isEmpty) {
      writeFields(handle);
      isEmpty = true;
      return std::move(handle);
    }
    return copied(allocator);
  }
  void restore(Message&& message) noexcept override {
    if (!isEmpty || !isLoaned) return;
    handle = std::move(message);
    isEmpty = false;
  }
  [[nodiscard]] std::int32_t status() const noexcept override { return statusOf(fields); }

 private:
  void writeFields(Message& message) const {
    T* written = message.tryAs<T>();
    const auto kept = written->length;
    *written = fields;
    written->length = kept;
  }
  Message copied(const Allocator& allocator) const;
  Message filled(const Allocator& allocator, std::span<const std::byte> bytes) const;
};

// A view of the buffer of an object, for one function.
class BufferView {
 public:
  // Throws nb::python_error, BufferError among others.
  explicit BufferView(nb::handle object) {
    if (PyObject_GetBuffer(object.ptr(), &view_, PyBUF_C_CONTIGUOUS) != 0) throw nb::python_error();
  }
  ~BufferView() { PyBuffer_Release(&view_); }
  BufferView(const BufferView&) = delete;
  BufferView& operator=(const BufferView&) = delete;

  [[nodiscard]] std::span<const std::byte> bytes() const noexcept {
    return {static_cast<const std::byte*>(view_.buf), static_cast<std::size_t>(view_.len)};
  }

 private:
  Py_buffer view_{};
};

template <ArrayBody T>
Message PyArray<T>::copied(const Allocator& allocator) const {
  if (isEmpty) throw nb::value_error(kWasSent);
  if (!values.is_valid())
    return filled(allocator, std::as_bytes(std::as_const(handle).template valueAs<T>()));
  const BufferView view(values);
  return filled(allocator, view.bytes());
}

template <ArrayBody T>
Message PyArray<T>::filled(const Allocator& allocator, std::span<const std::byte> bytes) const {
  using Element = typename T::Element;
  const auto count = bytes.size() / sizeof(Element);
  auto message = allocator.array<T>(count);
  copyBytes(reinterpret_cast<std::byte*>(message.value().data()),
            bytes.first(count * sizeof(Element)));
  writeFields(message);
  return message;
}

// The largest message of a server.
struct SizeLimit {
  const std::string& server;
  std::uint64_t bytes;  // 0: not known
};

// The object of Python for a received message, which it owns.
//   throws  nb::python_error; TypeError of a type that Python does not have
[[nodiscard]] nb::object toPython(Message&& message);
// The same for a request, whose handle the object owns. Empty, with `request` unchanged, if Python
// does not have its type, or if its body does not fit the type.
[[nodiscard]] nb::object tryRequestToPython(Message&& request);
// An array message in the memory that is shared with the peer, for the program to fill in.
//   type    mpf.Int32Array, mpf.Float64Array, mpf.Char8Array or mpf.User
//   throws  nb::python_error: TooLarge
[[nodiscard]] nb::object loan(const Allocator& allocator, nb::handle type, std::size_t length,
                              const SizeLimit& limit);

// Adds the classes to the module.
void addMessages(nb::module_& module);

}  // namespace mpf::python
