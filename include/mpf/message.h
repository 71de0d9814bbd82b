// SPDX-License-Identifier: MIT
// Message: a handle that owns one message of any type. <mpf/message_of.h> adds MessageOf<T>, the
// handle of a message of type T.
//
//   Message = | type, clientType, clientExtra, time stamp | route | body: 32 bytes inline, or out
//               of line |
//
// Sending moves the message away; a received message belongs to the receiver. A server may change a
// request and reply with it, or allocate another message. Handles cannot be copied; duplicate()
// copies a message.
//
//   void onMessage(mpf::Message&& message) {                    // the callback of a client
//     if (const auto* reply = message.tryAs<mpf::Int32>()) use(reply->status, reply->value);
//     for (const double sample : message.valueAs<mpf::Float64Array>()) use(sample);
//   }                                                           // the handle frees the body
//
//   size of the body   where it is                              how it is sent
//   up to 32 bytes     inside the handle                        copied
//   larger             on the heap                              copied
//                      in the memory that client and server     in place: nothing is copied
//                      share for this connection
//                      in the memory that a server shares       MessageServer::publish() copies
//                      with all of its clients                  nothing; others copy
//
// A received large body occupies the shared memory of its sender until the handle is destroyed or
// sent: a program that keeps many such handles makes the sender run out of memory. The body stays
// readable when the sender disconnects or dies.
//
// Threads  one thread at a time uses a handle; it may move to another thread. The thread that
//          destroys a handle calls the lender of its body.
// Throws   duplicate() and copyOf(), which allocate; all other public functions are noexcept.
// Crash    <mpf/message_client.h> and <mpf/message_server.h> describe what the peer sees.
// Trust    a peer may write anything to a body in shared memory, at any time. The number of
//          elements of an array follows from the size of its body; `length` is never read.
// Source   manual, "Message", "Overview". Free lists, toBuffer() and fromBuffer() are not needed.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>

#include <mpf/detail/copy_words.h>
#include <mpf/message_body.h>
#include <mpf/message_layout.h>
#include <mpf/message_route.h>
#include <mpf/message_types.h>

namespace mpf {

class Message {
 public:
  // [bytes] A body of at most this size, which includes every scalar, is inside the handle. Moving
  // the handle moves such a body, and pointers to its fields become invalid.
  static constexpr std::size_t kInlineBytes = 32;

  // An empty handle: type none, everything else 0.
  Message() noexcept = default;
  // Moves the message with its route: of a request, only the last handle reports to the
  // RouteKeeper. `other` is empty then.
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
  // Assignment and destruction end the former message as reset() does: a request that has had no
  // reply is refused.
  ~Message() { giveBack(); }

  // False for an empty handle: default constructed, moved from, sent, or reset().
  explicit operator bool() const noexcept { return state_.type != MessageType::none; }
  // MessageType::none for an empty handle. A received message may have a type that this program
  // does not know; then isSound() is false.
  [[nodiscard]] MessageType getType() const noexcept { return state_.type; }

  // Two numbers of the client's own choice, any value, 0 by default. The client sets them before
  // it sends the request; every reply and fate has the same numbers (manual, "Message",
  // "Overview"). Servers should not use them. DevMpf uses clientType for itself; classes derived
  // from it may use clientExtra.
  [[nodiscard]] std::int32_t getClientType() const noexcept { return state_.clientType; }
  void setClientType(std::int32_t type) noexcept { state_.clientType = type; }
  [[nodiscard]] std::int32_t getClientExtra() const noexcept { return state_.clientExtra; }
  void setClientExtra(std::int32_t extra) noexcept { state_.clientExtra = extra; }

  // When the data of a reply was taken: [ns] since 1970, UTC without leap seconds (CLOCK_REALTIME).
  // 0: the server did not say. Servers may set it in each message that they send; in a request it
  // is not sent. A peer may have sent any value.
  [[nodiscard]] std::int64_t getTimeStampNs() const noexcept { return state_.timeStampNs; }
  void setTimeStampNs(std::int64_t timeNs) noexcept { state_.timeStampNs = timeNs; }

  // In messages that a client received: how many messages to the same request the server has
  // dropped since the last one that it published (MessageServer::publish()), because this client
  // had not destroyed, or not received, enough of the earlier ones; at most 2^24 - 1. 0 for all
  // other messages. With a server on another host, the router of that host adds what it drops.
  [[nodiscard]] std::uint32_t getMissed() const noexcept {
    return state_.route.link == 0 ? state_.route.flags >> kMissedShift : 0;
  }

  // The fields, in place: valid until the handle is moved, sent or destroyed. Returns nullptr when
  // the message has another type than T or its body is invalid. A peer may change T::length at any
  // time: use arrayLength() or valueAs(). It may change all other fields as well, if the body is in
  // shared memory: copy a field before you check it.
  template <MessageBody T>
  [[nodiscard]] T* tryAs() noexcept {
    return isA<T>() ? reinterpret_cast<T*>(data()) : nullptr;
  }
  template <MessageBody T>
  [[nodiscard]] const T* tryAs() const noexcept {
    return isA<T>() ? reinterpret_cast<const T*>(data()) : nullptr;
  }
  // The elements of an array, in place, valid as long as the fields; empty when tryAs<T>() returns
  // nullptr.
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

  // False when the type is unknown, or the body is misaligned, shorter than the fields of its type,
  // or ends within an element of its array. The check ran when the handle received the body.
  [[nodiscard]] bool isSound() const noexcept { return state_.sound; }
  // Number of elements of an array; 0 for scalars and invalid bodies.
  [[nodiscard]] std::uint32_t arrayLength() const noexcept { return state_.length; }
  // All bytes of the body, fields and elements, even when the body is invalid; valid as long as the
  // fields, empty for an empty handle.
  [[nodiscard]] std::span<const std::byte> body() const noexcept { return {data(), size()}; }

  // Copies type, clientType, clientExtra, time stamp, route and body; a large body is copied to the
  // heap. Only the original reports to the RouteKeeper: a request is not refused when only its copy
  // is destroyed. A server may reply with the copy.
  //   throws  std::bad_alloc
  [[nodiscard]] Message duplicate() const;

  // ---- for transports

  // Programs do not need these functions; a transport is code that moves messages between
  // processes, such as links and routers.

  // The route is not owned: setRoute() drops the former one without a call of its keeper.
  [[nodiscard]] const Route& route() const noexcept { return state_.route; }
  void setRoute(const Route& route) noexcept { state_.route = route; }
  // Replaces the keeper of the route, and returns the former one without a call.
  RouteKeeper* exchangeKeeper(RouteKeeper* keeper) noexcept {
    return std::exchange(state_.route.keeper, keeper);
  }

  // The bits of Route::flags for a number of missed messages.
  [[nodiscard]] static constexpr std::uint32_t missedFlags(std::uint32_t missed) noexcept {
    return std::min(missed, UINT32_MAX >> kMissedShift) << kMissedShift;
  }

  // What a transport knows of a message besides its type and body.
  struct Attributes {
    Route route;
    std::int32_t clientType;
    std::int32_t clientExtra;
    std::int64_t timeStampNs;
  };
  // Becomes the owner of a body and checks it: isSound() is the result. The lender gets the body
  // back when the handle is destroyed or reset, also when the body is invalid.
  //   body  invalid unless it has all fields and elements of the type and is aligned to 8 bytes.
  //         Without a lender, its memory must outlive the handle.
  [[nodiscard]] static Message adopt(MessageType type, BodyBytes body,
                                     const Attributes& attributes = {}) noexcept {
    Message message;
    message.setAll(type, kOutside, inRegisters(attributes));
    message.state_.at.body = body;
    message.check();
    return message;
  }
  // Copies `bytes` into the handle, or to the heap when they are more than kInlineBytes, and checks
  // the copy: isSound() is the result. `bytes` may have any alignment, and any contents. The
  // message has no route, and its clientType and clientExtra are 0.
  //   throws  std::bad_alloc
  [[nodiscard]] static Message copyOf(MessageType type, std::span<const std::byte> bytes);
  // As copyOf(), for at most kInlineBytes bytes; further bytes are dropped.
  [[nodiscard]] static Message copyInline(MessageType type,
                                          std::span<const std::byte> bytes) noexcept {
    Message message;
    const auto size = std::min(bytes.size(), kInlineBytes);
    message.assignInline(type, size, {},
                         [&](auto to) { std::copy_n(bytes.data(), size, to.data()); });
    return message;
  }
  // Resets this handle and makes it a message with these attributes: `fill` receives a span of its
  // kInlineBytes bytes and writes the first `size` of them, then the body is checked: isSound() is
  // the result. `fill` must not throw. `size` must be at most kInlineBytes, which is not checked.
  template <class Fill>
  void assignInline(MessageType type, std::size_t size, const Attributes& attributes,
                    Fill&& fill) noexcept {
    reset();
    setAll(type, static_cast<std::uint8_t>(size), attributes);
    fill(std::span<std::byte, kInlineBytes>(state_.at.inside));
    check();
  }
  // Empties the handle: returns the body to its lender, and reports a request that has had no reply
  // to its RouteKeeper. Keeps clientType, clientExtra and the route, without its keeper.
  void reset() noexcept {
    giveBack();
    forget();
  }
  // The owner of an out-of-line body; nullptr for an inline body.
  [[nodiscard]] BodyLender* lender() const noexcept {
    return state_.isOutside() ? state_.at.body.lender : nullptr;
  }
  // Whether the body is inside the handle; true for an empty handle.
  [[nodiscard]] bool isInline() const noexcept { return !state_.isOutside(); }
  // [bytes] The body could have this size in its present memory; kInlineBytes for an inline body
  // and for an empty handle.
  // The analyzer does not follow the copy of the body word by word.
  // NOLINTNEXTLINE(clang-analyzer-core.uninitialized.UndefReturn)
  [[nodiscard]] std::size_t capacity() const noexcept {
    return state_.isOutside() ? state_.at.body.capacity : kInlineBytes;
  }
  // Empties the handle and passes ownership of its out-of-line body to the caller, who passes it to
  // adopt() or to its lender. Drops an inline body: `data` of the result is nullptr. Does not call
  // the RouteKeeper.
  [[nodiscard]] BodyBytes releaseBody() noexcept {
    const BodyBytes body = state_.isOutside() ? state_.at.body : BodyBytes{};
    forget();
    return body;
  }

 protected:
  // Fills an empty handle with a scalar.
  template <class T>
  void setFields(MessageType type, const T& fields) noexcept {
    state_.type = type;
    state_.inlineSize = sizeof(T);
    state_.sound = true;
    std::memcpy(state_.at.inside.data(), &fields, sizeof(T));
  }
  // True when the type is T and the body is valid; false for an empty handle.
  template <class T>
  [[nodiscard]] bool isA() const noexcept {
    return state_.type == T::kType && state_.sound;
  }
  // The body and its size in bytes, wherever it is.
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

  // The largest number of elements of T that fits the memory of the body; 0 for another type.
  template <ArrayBody T>
  [[nodiscard]] std::size_t maxLength() const noexcept {
    if (!isA<T>()) return 0;
    return std::min<std::size_t>((capacity() - sizeof(T)) / sizeof(typename T::Element),
                                 UINT32_MAX);
  }
  // Sets the array length and the size of the body. Returns false, and changes nothing, when the
  // memory is too small.
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
  // Throws std::length_error: "int32Array: length 500 is too large: there is room for 100".
  [[noreturn]] static void refuseLength(MessageType type, std::size_t length, std::size_t room);

 private:
  static constexpr std::uint8_t kOutside = 0xff;
  static constexpr unsigned kMissedShift = 8;
  // The bytes of an inline body, or the description of an out-of-line body: see inlineSize.
  union Where {
    alignas(8) std::array<std::byte, kInlineBytes> inside;
    BodyBytes body;
    Where() noexcept : inside{} {}
    Where(const Where& other) noexcept {
      detail::copyWords<kInlineBytes>(inside.data(), other.inside.data());
    }
    Where& operator=(const Where& other) noexcept {
      detail::copyWords<kInlineBytes>(inside.data(), other.inside.data());
      return *this;
    }
  };
  struct State {
    Where at;
    Route route{};
    std::int64_t timeStampNs = 0;
    std::int32_t clientType = 0;
    std::int32_t clientExtra = 0;
    // Of an array: the number of its elements. A peer cannot write here.
    std::uint32_t length = 0;
    MessageType type = MessageType::none;
    std::uint8_t inlineSize = 0;  // kOutside: the body is out of line
    bool sound = false;  // the result of check()

    [[nodiscard]] bool isOutside() const noexcept { return inlineSize == kOutside; }
    State() noexcept = default;
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): the assignment sets every field
    State(const State& other) noexcept { *this = other; }
    // Field by field: see copy_words.h.
    State& operator=(const State& other) noexcept {
      at = other.at;
      detail::copyField(route.link, other.route.link);
      detail::copyField(route.requestId, other.route.requestId);
      detail::copyField(route.flags, other.route.flags);
      detail::copyField(route.keeper, other.route.keeper);
      detail::copyField(timeStampNs, other.timeStampNs);
      detail::copyField(clientType, other.clientType);
      detail::copyField(clientExtra, other.clientExtra);
      detail::copyField(length, other.length);
      detail::copyField(type, other.type);
      detail::copyField(inlineSize, other.inlineSize);
      detail::copyField(sound, other.sound);
      return *this;
    }
  };

  // Loads each attribute by itself: a wider load would wait for stores that another function has
  // just made (copy_words.h).
  static Attributes inRegisters(const Attributes& all) noexcept {
    using detail::alone;
    return {{alone(all.route.link), alone(all.route.requestId), alone(all.route.flags),
             alone(all.route.keeper)},
            alone(all.clientType),
            alone(all.clientExtra),
            alone(all.timeStampNs)};
  }
  void setAll(MessageType type, std::uint8_t inlineSize, const Attributes& attributes) noexcept {
    state_.type = type;
    state_.inlineSize = inlineSize;
    state_.route = attributes.route;
    state_.clientType = attributes.clientType;
    state_.clientExtra = attributes.clientExtra;
    state_.timeStampNs = attributes.timeStampNs;
  }
  // Sets `sound`, and `length` of a valid array, from the size of the body. Does not read the body:
  // its first line may be in the cache of the processor that wrote it.
  void check() noexcept {
    const auto& layout = layoutOf(state_.type);
    const auto bytes = size();
    state_.sound = layout.headerBytes != 0 && bytes >= layout.headerBytes && isAligned();
    if (!state_.sound || layout.elementBytes == 0) return;
    const auto elements = (bytes - layout.headerBytes) >> std::countr_zero(layout.elementBytes);
    state_.sound =
        layout.headerBytes + elements * layout.elementBytes == bytes && elements <= UINT32_MAX;
    if (state_.sound) state_.length = static_cast<std::uint32_t>(elements);
  }
  [[nodiscard]] bool isAligned() const noexcept {
    return !state_.isOutside() || reinterpret_cast<std::uintptr_t>(state_.at.body.data) % 8 == 0;
  }
  // Makes the handle empty: neither the body nor the request is given back.
  void forget() noexcept {
    state_.type = MessageType::none;
    state_.route.keeper = nullptr;
    state_.inlineSize = 0;
    state_.timeStampNs = 0;
    state_.length = 0;
    state_.sound = false;
  }
  void giveBack() noexcept {
    if (state_.route.keeper != nullptr || state_.isOutside()) giveBackOwned();
  }
  // Reports a request that has had no reply, and returns a body to its lender.
  [[gnu::noinline]] void giveBackOwned() noexcept {
    if (state_.route.keeper != nullptr) state_.route.keeper->abandoned(state_.route);
    // NOLINTNEXTLINE(clang-analyzer-core.UndefinedBinaryOperatorResult): as above
    if (state_.isOutside() && state_.at.body.lender != nullptr)
      state_.at.body.lender->takeBack(state_.at.body.data, state_.at.body.capacity);
  }

  State state_;
};
// Each move copies the whole handle, so it stays small.
static_assert(sizeof(Message) <= 80);

}  // namespace mpf
