// SPDX-License-Identifier: MIT
// Message: a handle that owns one message of any type. MessageOf<T>: a handle of a message of type
// T.
//
//   Message = | type, clientType, clientExtra | route | body: up to 32 bytes inline, or in memory
//   of a lender |
//
// Sending moves the message away; a received message belongs to the receiver. A server may change a
// request and reply with it, or allocate another message. Handles cannot be copied; duplicate()
// copies a message.
//
// Threads  one at a time for a handle; the lender of the body is called by any thread.
// Trust    a peer may write anything to a body, at any time. adopt() and copyOf() check the body
//          once and store its array length; tryAs(), value() and setLength() use only the stored
//          length.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <utility>

#include <mpf/detail/copy_words.h>
#include <mpf/message_types.h>

namespace mpf {

// Owner of the memory of out-of-line bodies: a link's pool, the heap. The handle that ends calls
// takeBack() once for its body, on its own thread.
class BodyLender {
 public:
  virtual void takeBack(std::byte* data, std::size_t capacity) noexcept = 0;

 protected:
  ~BodyLender() = default;
};

// An out-of-line body, for transports. It owns nothing: pass it to adopt() or takeBack() exactly
// once.
struct BodyBytes {
  std::byte* data = nullptr;  // aligned to 8 bytes or more
  std::size_t size = 0;  // bytes in use
  std::size_t capacity = 0;  // bytes in all
  BodyLender* lender = nullptr;
};

// Allocates memory of this process, aligned to 64 bytes. Throws std::bad_alloc.
[[nodiscard]] BodyBytes allocateHeapBody(std::size_t bytes);
[[nodiscard]] BodyLender& heapLender() noexcept;

// Is told when the handle of a request is destroyed without a reply. Must outlive every handle.
struct Route;
class RouteKeeper {
 public:
  virtual void abandoned(const Route& route) noexcept = 0;

 protected:
  ~RouteKeeper() = default;
};

// in the flags of a message that a client received: it ended its request
inline constexpr std::uint32_t kEndsRequest = 1;
// Where a reply to this message goes. For transports: servers copy it into replies and do not read
// it.
struct Route {
  std::uint64_t link{};
  std::uint32_t requestId{};
  std::uint32_t flags{};
  RouteKeeper* keeper = nullptr;  // of requests only
};

class Message {
 public:
  // Bodies up to this size, all scalars included, are in the handle; pointers to them are valid as
  // long as the handle.
  static constexpr std::size_t kInlineBytes = 32;

  Message() noexcept = default;
  // NOLINTNEXTLINE(performance-move-constructor-init): the state is plain data
  Message(Message&& other) noexcept : state_(other.state_) { other.forget(); }
  Message& operator=(Message&& other) noexcept {
    if (this != &other) {
      giveBack();
      state_ = other.state_;
      other.forget();
    }
    return *this;
  }
  Message(const Message&) = delete;
  Message& operator=(const Message&) = delete;
  ~Message() { giveBack(); }

  // False for an empty or moved-from handle.
  explicit operator bool() const noexcept { return state_.type != MessageType::none; }
  [[nodiscard]] MessageType getType() const noexcept { return state_.type; }

  // Marks of the client, which replies return (manual, "Message"). DevMpf uses clientType for
  // itself.
  [[nodiscard]] std::int32_t getClientType() const noexcept { return state_.clientType; }
  void setClientType(std::int32_t type) noexcept { state_.clientType = type; }
  [[nodiscard]] std::int32_t getClientExtra() const noexcept { return state_.clientExtra; }
  void setClientExtra(std::int32_t extra) noexcept { state_.clientExtra = extra; }

  // The fields; nullptr when the message is of another type or its body is invalid.
  template <MessageBody T>
  [[nodiscard]] T* tryAs() noexcept {
    return isA<T>() ? reinterpret_cast<T*>(data()) : nullptr;
  }
  template <MessageBody T>
  [[nodiscard]] const T* tryAs() const noexcept {
    return isA<T>() ? reinterpret_cast<const T*>(data()) : nullptr;
  }
  // The elements of an array; empty when tryAs<T>() is nullptr.
  template <ArrayBody T>
  [[nodiscard]] std::span<typename T::Element> valueAs() noexcept {
    if (!isA<T>()) return {};
    return {reinterpret_cast<typename T::Element*>(data() + sizeof(T)), state_.length};
  }
  template <ArrayBody T>
  [[nodiscard]] std::span<const typename T::Element> valueAs() const noexcept {
    if (!isA<T>()) return {};
    return {reinterpret_cast<const typename T::Element*>(data() + sizeof(T)), state_.length};
  }

  // False when the body is too short, misaligned or shorter than its array, or the type is unknown.
  [[nodiscard]] bool isSound() const noexcept { return state_.sound; }
  // Number of elements of an array; 0 for other types.
  [[nodiscard]] std::uint32_t arrayLength() const noexcept { return state_.length; }
  [[nodiscard]] std::span<const std::byte> body() const noexcept { return {data(), size()}; }

  // A copy with the same type, marks, route and bytes; large bodies on the heap (std::bad_alloc).
  [[nodiscard]] Message duplicate() const;

  // ---- for transports

  [[nodiscard]] const Route& route() const noexcept { return state_.route; }
  void setRoute(const Route& route) noexcept { state_.route = route; }

  // Takes over a body and checks it.
  [[nodiscard]] static Message adopt(MessageType type, BodyBytes body) noexcept {
    Message message;
    message.state_.type = type;
    message.state_.inlineSize = kOutside;
    message.state_.at.body = body;
    message.check();
    return message;
  }
  // Copies a body into the handle, or to the heap above kInlineBytes (std::bad_alloc), and checks
  // the copy.
  [[nodiscard]] static Message copyOf(MessageType type, std::span<const std::byte> bytes);
  // The same for at most kInlineBytes bytes.
  [[nodiscard]] static Message copyInline(MessageType type,
                                          std::span<const std::byte> bytes) noexcept {
    Message message;
    message.state_.type = type;
    message.state_.inlineSize = static_cast<std::uint8_t>(std::min(bytes.size(), kInlineBytes));
    if (!bytes.empty()) std::memcpy(message.data(), bytes.data(), message.state_.inlineSize);
    message.check();
    return message;
  }
  // The same without a copy: `fill` gets the kInlineBytes bytes of this handle and writes `size` of
  // them.
  template <class Fill>
  void assignInline(MessageType type, std::size_t size, Fill&& fill) noexcept {
    reset();
    state_.type = type;
    state_.inlineSize = static_cast<std::uint8_t>(size);
    fill(std::span<std::byte, kInlineBytes>(state_.at.inside));
    check();
  }
  // Empties the handle and returns the body to its lender.
  void reset() noexcept {
    giveBack();
    forget();
  }
  // Owner of an out-of-line body; nullptr for an inline body.
  [[nodiscard]] BodyLender* lender() const noexcept {
    return state_.isOutside() ? state_.at.body.lender : nullptr;
  }
  [[nodiscard]] bool isInline() const noexcept { return !state_.isOutside(); }
  // NOLINTNEXTLINE(clang-analyzer-core.uninitialized.UndefReturn): the analyzer does not follow the copy of the body word by word
  [[nodiscard]] std::size_t capacity() const noexcept {
    return state_.isOutside() ? state_.at.body.capacity : kInlineBytes;
  }
  // Hands over an out-of-line body and empties the handle. An inline body is lost: data is nullptr.
  [[nodiscard]] BodyBytes releaseBody() noexcept {
    const BodyBytes body = state_.isOutside() ? state_.at.body : BodyBytes{};
    forget();
    return body;
  }

 protected:
  template <class T>
  [[nodiscard]] bool isA() const noexcept {
    return state_.type == T::kType && state_.sound;
  }
  // NOLINTBEGIN(clang-analyzer-core.uninitialized.UndefReturn): as above
  [[nodiscard]] std::byte* data() noexcept {
    return state_.isOutside() ? state_.at.body.data : state_.at.inside.data();
  }
  [[nodiscard]] const std::byte* data() const noexcept {
    return state_.isOutside() ? state_.at.body.data : state_.at.inside.data();
  }
  [[nodiscard]] std::size_t size() const noexcept {
    return state_.isOutside() ? state_.at.body.size : state_.inlineSize;
  }
  // NOLINTEND(clang-analyzer-core.uninitialized.UndefReturn)

  template <ArrayBody T>
  [[nodiscard]] std::size_t maxLength() const noexcept {
    if (!isA<T>()) return 0;
    return std::min<std::size_t>((capacity() - sizeof(T)) / sizeof(typename T::Element),
                                 UINT32_MAX);
  }
  // Sets the array length and the size of the body. Returns false, and changes nothing, if there is
  // no room.
  template <ArrayBody T>
  [[nodiscard]] bool trySetArrayLength(std::size_t length) noexcept {
    if (!isA<T>() || length > maxLength<T>()) return false;
    state_.length = static_cast<std::uint32_t>(length);
    reinterpret_cast<T*>(data())->length = state_.length;
    const std::size_t bytes = sizeof(T) + length * sizeof(typename T::Element);
    if (state_.isOutside()) state_.at.body.size = bytes;
    else state_.inlineSize = static_cast<std::uint8_t>(bytes);
    return true;
  }
  // Throws std::length_error: "int32Array: length 500 was asked for, there is room for 100".
  [[noreturn]] static void refuseLength(MessageType type, std::size_t length, std::size_t room);

 private:
  static constexpr std::uint8_t kOutside = 0xff;
  union Where {
    alignas(8) std::array<std::byte, kInlineBytes> inside;
    BodyBytes body;
    Where() noexcept : inside{} {}
    Where(const Where& other) noexcept {
      copyWords<kInlineBytes>(inside.data(), other.inside.data());
    }
    Where& operator=(const Where& other) noexcept {
      copyWords<kInlineBytes>(inside.data(), other.inside.data());
      return *this;
    }
  };
  struct State {
    Where at;
    Route route{};
    std::uint32_t length = 0;  // of an array; checked, and not accessible to the peer
    std::int32_t clientType = 0;
    std::int32_t clientExtra = 0;
    MessageType type = MessageType::none;
    std::uint8_t inlineSize = 0;  // kOutside: the body is out of line
    bool sound = false;

    [[nodiscard]] bool isOutside() const noexcept { return inlineSize == kOutside; }
    State() noexcept = default;
    State(const State& other) noexcept {
      *this = other;
    }  // NOLINT(cppcoreguidelines-pro-type-member-init)
    // Field by field: see copy_words.h.
    State& operator=(const State& other) noexcept {
      at = other.at;
      copyField(route.link, other.route.link);
      copyField(route.requestId, other.route.requestId);
      copyField(route.flags, other.route.flags);
      copyField(route.keeper, other.route.keeper);
      copyField(length, other.length);
      copyField(clientType, other.clientType);
      copyField(clientExtra, other.clientExtra);
      copyField(type, other.type);
      copyField(inlineSize, other.inlineSize);
      copyField(sound, other.sound);
      return *this;
    }
  };

  void check() noexcept {
    const auto& layout = layoutOf(state_.type);
    const std::byte* const bytes = data();
    state_.sound = layout.headerBytes != 0 && size() >= layout.headerBytes &&
                   reinterpret_cast<std::uintptr_t>(bytes) % 8 == 0;
    if (!state_.sound || layout.elementBytes == 0) return;
    // Read once, since a peer may change it.
    const std::uint32_t length =
        *reinterpret_cast<const volatile std::uint32_t*>(bytes + layout.lengthOffset);
    state_.sound = length <= (size() - layout.headerBytes) / layout.elementBytes;
    if (state_.sound) state_.length = length;
  }
  void forget() noexcept {
    state_.type = MessageType::none;
    state_.route.keeper = nullptr;
    state_.inlineSize = 0;
    state_.length = 0;
    state_.sound = false;
  }
  void giveBack() noexcept {
    if (state_.route.keeper != nullptr) state_.route.keeper->abandoned(state_.route);
    // NOLINTNEXTLINE(clang-analyzer-core.UndefinedBinaryOperatorResult): as above
    if (state_.isOutside() && state_.at.body.lender != nullptr)
      state_.at.body.lender->takeBack(state_.at.body.data, state_.at.body.capacity);
  }

  State state_;
};
static_assert(sizeof(Message) <= 72);

// A message of type T: `MessageOf(Int32{.address = 3, .value = 5})`;
// `Int32ArrayMessage::allocValue(1000)`.
template <MessageBody T>
class MessageOf : public Message {
 public:
  using Body = T;

  MessageOf() noexcept
    requires ScalarBody<T>
      : MessageOf(T{}) {}
  explicit MessageOf(const T& fields) noexcept
    requires ScalarBody<T>
      : Message(copyInline(T::kType, std::as_bytes(std::span(&fields, 1)))) {
    static_assert(sizeof(T) <= kInlineBytes);
  }

  // An array of n elements on the heap: fields zero, elements not initialised. Throws
  // std::bad_alloc.
  [[nodiscard]] static MessageOf allocValue(std::size_t n)
    requires ArrayBody<T>
  {
    if (n > UINT32_MAX) refuseLength(T::kType, n, UINT32_MAX);
    return inBuffer(allocateHeapBody(bytesFor(n)), n);
  }
  // Bytes that an array of n elements needs, to be requested from a lender.
  [[nodiscard]] static constexpr std::size_t bytesFor(std::size_t n) noexcept
    requires ArrayBody<T>
  {
    return sizeof(T) + n * sizeof(typename T::Element);
  }
  // As allocValue() in memory of a lender; if n elements do not fit, returns it and throws
  // std::length_error.
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
  // The typed handle of a message; nullopt, with `message` unchanged, for another type or an
  // invalid body.
  [[nodiscard]] static std::optional<MessageOf> tryFrom(Message&& message) noexcept {
    if (message.tryAs<T>() == nullptr) return std::nullopt;
    return MessageOf(std::move(message), Known{});
  }

  // The fields. The handle must not be empty.
  [[nodiscard]] T& operator*() noexcept { return *reinterpret_cast<T*>(data()); }
  [[nodiscard]] const T& operator*() const noexcept { return *reinterpret_cast<const T*>(data()); }
  [[nodiscard]] T* operator->() noexcept { return &**this; }
  [[nodiscard]] const T* operator->() const noexcept { return &**this; }

  // The elements of the array.
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

  // Numeric arrays count elements. setLength throws std::length_error above getMaxLength().
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

  // Char8Array and User count bytes. setSize throws std::length_error above getMaxSize().
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
