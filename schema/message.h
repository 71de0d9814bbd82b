// SPDX-License-Identifier: MIT
// Message: the one owner of a message on its way, whatever its type. MessageOf<T>: the same, with its type known.
//
//   Message = | type, clientType, clientExtra | route | body: up to 32 bytes inside, or elsewhere in its lender's memory |
//
// Who holds the handle owns the message: sending moves it away, what is received is the receiver's. A server may change a request and
// reply with it, or allocate another. A moved-from handle is empty. Copying does not compile; duplicate() says what it costs.
//
// Threads  a handle belongs to one thread at a time; its lender may be told from any thread.
// Trust    a body may come from a peer that lies and goes on writing. adopt() and copyOf() check it once against its type and keep the
//          array length that they checked; tryAs(), value() and setLength() use that, never the bytes again.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <utility>

#include <mpf/base/copy_words.h>
#include <mpf/schema/message_types.h>

namespace mpf {

// Whose memory a body is in: a link's pool, the heap. Told once per body, when its handle dies, from the thread where that happens.
class BodyLender {
 public:
  virtual void takeBack(std::byte* data, std::size_t capacity) noexcept = 0;

 protected:
  ~BodyLender() = default;
};

// A body outside its handle, as transports pass it around. Owns nothing by itself: one of adopt() or takeBack() follows.
struct BodyBytes {
  std::byte* data = nullptr;  // 8-aligned at least
  std::size_t size = 0;       // bytes that are there
  std::size_t capacity = 0;   // bytes that would fit
  BodyLender* lender = nullptr;
};

// Memory of our own process, 64-aligned. Throws std::bad_alloc.
[[nodiscard]] BodyBytes allocateHeapBody(std::size_t bytes);
[[nodiscard]] BodyLender& heapLender() noexcept;

// Who must know when the handle of a request dies that nobody answered. Lives longer than every handle.
struct Route;
class RouteKeeper {
 public:
  virtual void abandoned(const Route& route) noexcept = 0;

 protected:
  ~RouteKeeper() = default;
};

inline constexpr std::uint32_t kEndsRequest = 1;  // in the flags of what a client got: it ended its request
// Where a reply to this message goes. For transports; copied into replies, carried through servers, never interpreted by them.
struct Route {
  std::uint64_t link{};
  std::uint32_t requestId{};
  std::uint32_t flags{};
  RouteKeeper* keeper = nullptr;  // of a request only
};

class Message {
 public:
  // Bodies up to this size live in the handle: all scalars do, and a pointer into them ends with the handle.
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

  // False: empty, moved away.
  explicit operator bool() const noexcept { return state_.type != MessageType::none; }
  [[nodiscard]] MessageType getType() const noexcept { return state_.type; }

  // The client's own marks; replies carry them back (manual, "Message"). Classes derived from DevMpf leave clientType alone.
  [[nodiscard]] std::int32_t getClientType() const noexcept { return state_.clientType; }
  void setClientType(std::int32_t type) noexcept { state_.clientType = type; }
  [[nodiscard]] std::int32_t getClientExtra() const noexcept { return state_.clientExtra; }
  void setClientExtra(std::int32_t extra) noexcept { state_.clientExtra = extra; }

  // The fields, or nullptr when the message is of another type or its body is no such thing. An array's elements: valueAs().
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

  // False: too short for its type, misaligned, an array longer than its body, or a type that this program does not know.
  [[nodiscard]] bool isSound() const noexcept { return state_.sound; }
  // Elements of an array, 0 for other types.
  [[nodiscard]] std::uint32_t arrayLength() const noexcept { return state_.length; }
  [[nodiscard]] std::span<const std::byte> body() const noexcept { return {data(), size()}; }

  // A second message with the same type, marks, route and bytes; large bodies on the heap (std::bad_alloc).
  [[nodiscard]] Message duplicate() const;

  // ---- for transports

  [[nodiscard]] const Route& route() const noexcept { return state_.route; }
  void setRoute(const Route& route) noexcept { state_.route = route; }

  // Takes a body over, and checks it once.
  [[nodiscard]] static Message adopt(MessageType type, BodyBytes body) noexcept {
    Message message;
    message.state_.type = type;
    message.state_.inlineSize = kOutside;
    message.state_.at.body = body;
    message.check();
    return message;
  }
  // Copies bytes, into the handle or onto the heap (std::bad_alloc, only above kInlineBytes), and checks the copy.
  [[nodiscard]] static Message copyOf(MessageType type, std::span<const std::byte> bytes);
  // The same for bytes that fit into the handle, and nothing else.
  [[nodiscard]] static Message copyInline(MessageType type, std::span<const std::byte> bytes) noexcept {
    Message message;
    message.state_.type = type;
    message.state_.inlineSize = static_cast<std::uint8_t>(std::min(bytes.size(), kInlineBytes));
    if (!bytes.empty()) std::memcpy(message.data(), bytes.data(), message.state_.inlineSize);
    message.check();
    return message;
  }
  // The same in two steps, into this handle, for the path where every copy counts: `fill` gets the kInlineBytes of the handle and
  // writes `size` of them.
  template <class Fill>
  void assignInline(MessageType type, std::size_t size, Fill&& fill) noexcept {
    reset();
    state_.type = type;
    state_.inlineSize = static_cast<std::uint8_t>(size);
    fill(std::span<std::byte, kInlineBytes>(state_.at.inside));
    check();
  }
  // Empties the handle: the body goes back.
  void reset() noexcept {
    giveBack();
    forget();
  }
  // Who must get the body back; nullptr when it is inside the handle.
  [[nodiscard]] BodyLender* lender() const noexcept { return state_.isOutside() ? state_.at.body.lender : nullptr; }
  [[nodiscard]] bool isInline() const noexcept { return !state_.isOutside(); }
  // NOLINTNEXTLINE(clang-analyzer-core.uninitialized.UndefReturn): the analyzer does not follow the copy of the body word by word
  [[nodiscard]] std::size_t capacity() const noexcept { return state_.isOutside() ? state_.at.body.capacity : kInlineBytes; }
  // Hands an outside body over and leaves the handle empty. Of a body inside the handle nothing is left: data is nullptr.
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
  [[nodiscard]] std::byte* data() noexcept { return state_.isOutside() ? state_.at.body.data : state_.at.inside.data(); }
  [[nodiscard]] const std::byte* data() const noexcept { return state_.isOutside() ? state_.at.body.data : state_.at.inside.data(); }
  [[nodiscard]] std::size_t size() const noexcept { return state_.isOutside() ? state_.at.body.size : state_.inlineSize; }
  // NOLINTEND(clang-analyzer-core.uninitialized.UndefReturn)

  template <ArrayBody T>
  [[nodiscard]] std::size_t maxLength() const noexcept {
    if (!isA<T>()) return 0;
    return std::min<std::size_t>((capacity() - sizeof(T)) / sizeof(typename T::Element), UINT32_MAX);
  }
  // Sets the length here, in the header, and the size of the body. False, and nothing is changed: no room.
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
    Where(const Where& other) noexcept { copyWords<kInlineBytes>(inside.data(), other.inside.data()); }
    Where& operator=(const Where& other) noexcept {
      copyWords<kInlineBytes>(inside.data(), other.inside.data());
      return *this;
    }
  };
  struct State {
    Where at;
    Route route{};
    std::uint32_t length = 0;  // of an array: checked, or set by us; the peer cannot reach it
    std::int32_t clientType = 0;
    std::int32_t clientExtra = 0;
    MessageType type = MessageType::none;
    std::uint8_t inlineSize = 0;  // kOutside: the body is elsewhere
    bool sound = false;

    [[nodiscard]] bool isOutside() const noexcept { return inlineSize == kOutside; }
    State() noexcept = default;
    State(const State& other) noexcept { *this = other; }  // NOLINT(cppcoreguidelines-pro-type-member-init)
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
    state_.sound = layout.headerBytes != 0 && size() >= layout.headerBytes && reinterpret_cast<std::uintptr_t>(bytes) % 8 == 0;
    if (!state_.sound || layout.elementBytes == 0) return;
    // Read once: what a peer writes there afterwards is of no interest.
    const std::uint32_t length = *reinterpret_cast<const volatile std::uint32_t*>(bytes + layout.lengthOffset);
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

// A message whose type is known. `MessageOf(Int32{.address = 3, .value = 5})`; `Int32ArrayMessage::allocValue(1000)`.
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

  // An array with room for n elements and that length, on the heap. The fields are zero, the elements whatever the memory held.
  // Throws std::bad_alloc.
  [[nodiscard]] static MessageOf allocValue(std::size_t n)
    requires ArrayBody<T>
  {
    if (n > UINT32_MAX) refuseLength(T::kType, n, UINT32_MAX);
    return inBuffer(allocateHeapBody(bytesFor(n)), n);
  }
  // Bytes that an array of n elements needs; what to ask a lender for.
  [[nodiscard]] static constexpr std::size_t bytesFor(std::size_t n) noexcept
    requires ArrayBody<T>
  {
    return sizeof(T) + n * sizeof(typename T::Element);
  }
  // The same in a lender's memory, built in place; n elements must fit, or the memory goes back and std::length_error says so.
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
  // The typed handle of a message; nullopt, and `message` is as it was, when it is of another type or unsound.
  [[nodiscard]] static std::optional<MessageOf> tryFrom(Message&& message) noexcept {
    if (message.tryAs<T>() == nullptr) return std::nullopt;
    return MessageOf(std::move(message), Known{});
  }

  // The fields. Not of an empty (moved-from) handle.
  [[nodiscard]] T& operator*() noexcept { return *reinterpret_cast<T*>(data()); }
  [[nodiscard]] const T& operator*() const noexcept { return *reinterpret_cast<const T*>(data()); }
  [[nodiscard]] T* operator->() noexcept { return &**this; }
  [[nodiscard]] const T* operator->() const noexcept { return &**this; }

  // The elements, getLength() of them.
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
    if (!this->template trySetArrayLength<T>(count)) refuseLength(T::kType, count, this->template maxLength<T>());
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
