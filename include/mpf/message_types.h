// SPDX-License-Identifier: MIT
// Message types: the body of each type of message in shared memory, with a description of its
// fields, from which sizes, checks, printing, parsing and the wire format are derived.
//
//   scalar   | Int32 |                                    fixed fields only
//   array    | Int32Array: fields, length | value[0] | value[1] | ...      elements follow the
//            header, 8-aligned
//
// The structs have fixed widths and the byte order of the host, since both ends are on one host.
// Another host gets the structs of message.capnp instead.
//
// CONTRIBUTING.md says how to add a type. schema_test compares the structs with message.capnp.
//
// Trust    a peer may write to a body while it is read, so `length` in the header must not be used
//          as the length of an array; use MessageOf::value().
// Source   manual, "StandardFieldsMessage"; the names of types and fields are those of the manual.
#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <tuple>
#include <type_traits>

namespace mpf {

enum class MessageType : std::uint16_t {
  none = 0,
  connect = 1,
  int32 = 2,
  int32Array = 3,
  float64 = 4,
  float64Array = 5,
  char8Array = 6,
  serialConfig = 7,
  outOfBand = 8,
  requestFate = 9,
  user = 10,
};

// The status of a ConnectMessage (manual, "ConnectMessage"). Old clients treat every value other
// than connectYes as a disconnect.
enum class ConnectStatus : std::int32_t {
  connectNo = 0,  // no server yet, or the server is gone
  connectYes = 1,  // messages reach the server
  // the server's queue was full: a message was refused, the client stays connected
  connectQueueFull = 2,
  connectRefused = 3,  // the server does not accept this client
};
inline constexpr std::array<std::string_view, 4> kConnectStatusNames{
    "connectNo", "connectYes", "connectQueueFull", "connectRefused"};

// How a request without a reply ended.
enum class Fate : std::int32_t {
  refused = 0,  // not accepted: queue full, too large, a type that the server does not take
  neverTaken = 1,  // the server went away before it took the request: nothing was done
  // the server took it and then went away, or did not reply: it may have been done
  outcomeUnknown = 2,
  expired = 3,  // its deadline passed before it was taken: nothing was done
  cancelled = 4,  // the client cancelled it
};
inline constexpr std::array<std::string_view, 5> kFateNames{
    "refused", "neverTaken", "outcomeUnknown", "expired", "cancelled"};

// ---- the description of a type

// A field: its name, which is the same in message.capnp and in texts, and the member.
template <class Body, class Value>
struct Field {
  std::string_view name;
  Value Body::* member;
};
template <class Body, class Value>
Field(std::string_view, Value Body::*) -> Field<Body, Value>;

// A short byte string inside the struct; the member `used` is the number of bytes in use.
template <class Body, std::size_t room>
struct BytesField {
  std::string_view name;
  std::array<char, room> Body::* member;
  std::int32_t Body::* used;
};
template <class Body, std::size_t room>
BytesField(std::string_view, std::array<char, room> Body::*, std::int32_t Body::*)
    -> BytesField<Body, room>;

template <class Body>
constexpr auto standardFields() {
  return std::tuple{Field{"timeout", &Body::timeout}, Field{"cmd", &Body::cmd},
                    Field{"status", &Body::status}, Field{"address", &Body::address},
                    Field{"extra", &Body::extra}};
}

// The name of the elements of an array in message.capnp and in texts.
inline constexpr std::string_view kValueName = "value";

// ---- the types; client and server agree on the meaning of timeout [s], cmd, status, address and
// extra (manual, "StandardFieldsMessage")

// Sent by MPF to a client: connected, disconnected, or a queue was full.
struct Connect {
  ConnectStatus status{};
  std::uint32_t reserved{};
  // identifies one life of the server; another number: it was restarted
  std::uint64_t incarnation{};

  static constexpr auto kType = MessageType::connect;
  static constexpr std::string_view kName = "connect";
  static constexpr auto fields() {
    return std::tuple{Field{"status", &Connect::status},
                      Field{"incarnation", &Connect::incarnation}};
  }
};

struct Int32 {
  std::int32_t timeout{}, cmd{}, status{}, address{}, extra{}, value{};

  static constexpr auto kType = MessageType::int32;
  static constexpr std::string_view kName = "int32";
  static constexpr auto fields() {
    return std::tuple_cat(standardFields<Int32>(), std::tuple{Field{kValueName, &Int32::value}});
  }
};

struct Int32Array {
  std::int32_t timeout{}, cmd{}, status{}, address{}, extra{};
  std::uint32_t length{};  // number of elements that follow; set by setLength() only

  using Element = std::int32_t;
  static constexpr auto kType = MessageType::int32Array;
  static constexpr std::string_view kName = "int32Array";
  static constexpr auto fields() { return standardFields<Int32Array>(); }
};

struct Float64 {
  std::int32_t timeout{}, cmd{}, status{}, address{}, extra{};
  std::uint32_t reserved{};
  double value{};

  static constexpr auto kType = MessageType::float64;
  static constexpr std::string_view kName = "float64";
  static constexpr auto fields() {
    return std::tuple_cat(standardFields<Float64>(),
                          std::tuple{Field{kValueName, &Float64::value}});
  }
};

struct alignas(8) Float64Array {
  std::int32_t timeout{}, cmd{}, status{}, address{}, extra{};
  std::uint32_t length{};  // number of elements that follow; set by setLength() only

  using Element = double;
  static constexpr auto kType = MessageType::float64Array;
  static constexpr std::string_view kName = "float64Array";
  static constexpr auto fields() { return standardFields<Float64Array>(); }
};

// Bytes or text; MPF does not interpret them.
struct Char8Array {
  std::int32_t timeout{}, cmd{}, status{}, address{}, extra{};
  std::uint32_t length{};  // number of bytes that follow; set by setSize() only
  std::int32_t numberRetrys{};
  std::int32_t eomLen{};
  std::array<char, 4> eomString{};
  std::uint32_t reserved{};

  // The end-of-message string; eomLen, which a peer may have written, is limited to the size of
  // eomString.
  [[nodiscard]] std::string_view eom() const noexcept {
    // read once: a peer may change it
    const std::int32_t used = *static_cast<const volatile std::int32_t*>(&eomLen);
    return {eomString.data(), static_cast<std::size_t>(std::clamp(
                                  used, 0, static_cast<std::int32_t>(eomString.size())))};
  }

  using Element = char;
  static constexpr auto kType = MessageType::char8Array;
  static constexpr std::string_view kName = "char8Array";
  static constexpr auto fields() {
    return std::tuple_cat(
        standardFields<Char8Array>(),
        std::tuple{Field{"numberRetrys", &Char8Array::numberRetrys},
                   Field{"eomLen", &Char8Array::eomLen},
                   BytesField{"eomString", &Char8Array::eomString, &Char8Array::eomLen}});
  }
};

// 0 in a field: keep the setting.
struct SerialConfig {
  std::int32_t baud{}, stopBits{}, bitsPerChar{};
  char parity{};  // 'E', 'O', 'N'
  char flowControl{};  // 'H', 'N'
  std::uint16_t reserved{};

  static constexpr auto kType = MessageType::serialConfig;
  static constexpr std::string_view kName = "serialConfig";
  static constexpr auto fields() {
    return std::tuple{
        Field{"baud", &SerialConfig::baud}, Field{"stopBits", &SerialConfig::stopBits},
        Field{"bitsPerChar", &SerialConfig::bitsPerChar}, Field{"parity", &SerialConfig::parity},
        Field{"flowControl", &SerialConfig::flowControl}};
  }
};

// Like Int32; sent by a server to a client without a request.
struct OutOfBand {
  std::int32_t timeout{}, cmd{}, status{}, address{}, extra{}, value{};

  static constexpr auto kType = MessageType::outOfBand;
  static constexpr std::string_view kName = "outOfBand";
  static constexpr auto fields() {
    return std::tuple_cat(standardFields<OutOfBand>(),
                          std::tuple{Field{kValueName, &OutOfBand::value}});
  }
};

// Sent by MPF to a client: how a request without a reply ended.
struct RequestFate {
  Fate fate{};
  std::uint32_t requestId{};

  static constexpr auto kType = MessageType::requestFate;
  static constexpr std::string_view kName = "requestFate";
  static constexpr auto fields() {
    return std::tuple{Field{"fate", &RequestFate::fate},
                      Field{"requestId", &RequestFate::requestId}};
  }
};

// A Cap'n Proto message of the user's own schema, in standard segment framing, readable in place.
// MPF forwards it without reading it.
struct alignas(8) User {
  std::uint32_t length{};  // number of bytes that follow; set by setSize() only
  std::uint32_t reserved{};

  using Element = std::byte;
  static constexpr auto kType = MessageType::user;
  static constexpr std::string_view kName = "user";
  static constexpr auto fields() { return std::tuple<>{}; }
};

// All types, in the order of their numbers.
using MessageTypes = std::tuple<Connect, Int32, Int32Array, Float64, Float64Array, Char8Array,
                                SerialConfig, OutOfBand, RequestFate, User>;

static_assert(sizeof(Connect) == 16 && sizeof(Int32) == 24 && sizeof(Float64) == 32 &&
              sizeof(SerialConfig) == 16);
static_assert(sizeof(OutOfBand) == 24 && sizeof(RequestFate) == 8);
static_assert(sizeof(Int32Array) == 24 && sizeof(Float64Array) == 24 && sizeof(Char8Array) == 40 &&
              sizeof(User) == 8);

// ---- derived from the descriptions

template <class T>
concept ArrayBody = requires { typename T::Element; };

template <class T>
concept MessageBody = requires {
  { T::kType } -> std::convertible_to<MessageType>;
} && std::is_trivially_copyable_v<T>;

template <class T>
concept ScalarBody = MessageBody<T> && !ArrayBody<T>;

template <class T>
// has setSize(), the others setLength(), as in the manual
concept CountedInBytes = ArrayBody<T> && sizeof(typename T::Element) == 1;

template <class T>
concept CountedInElements = ArrayBody<T> && !CountedInBytes<T>;

// The sizes that are needed to check a body. All are zero for an unknown type.
struct BodyLayout {
  std::uint32_t headerBytes = 0;
  std::uint32_t elementBytes = 0;  // 0: not an array
  std::uint32_t lengthOffset = 0;
  std::string_view name = "none";
};

namespace detail {

template <class T>
constexpr BodyLayout layoutOf() {
  static_assert(std::is_standard_layout_v<T> && std::is_trivially_copyable_v<T> && alignof(T) <= 8);
  static_assert(std::has_unique_object_representations_v<T> || std::is_same_v<T, Float64>,
                "padding would carry stray bytes to a peer");
  if constexpr (ArrayBody<T>) {
    static_assert(sizeof(T) % 8 == 0, "elements are 8-aligned");
    return {sizeof(T), sizeof(typename T::Element), offsetof(T, length), T::kName};
  } else {
    return {sizeof(T), 0, 0, T::kName};
  }
}

template <class... T>
constexpr auto layoutsOf(std::type_identity<std::tuple<T...>> /*types*/) {
  std::array<BodyLayout, sizeof...(T) + 1> layouts{};
  ((layouts[static_cast<std::size_t>(T::kType)] = layoutOf<T>()), ...);
  return layouts;
}
inline constexpr auto kLayouts = layoutsOf(std::type_identity<MessageTypes>{});
inline constexpr BodyLayout kUnknownLayout{.name = "unknown"};

}  // namespace detail

[[nodiscard]] constexpr const BodyLayout& layoutOf(MessageType type) noexcept {
  const auto at = static_cast<std::size_t>(type);
  return at < detail::kLayouts.size() ? detail::kLayouts[at] : detail::kUnknownLayout;
}

// The name of a type, a status or a fate; "unknown" for a value of a newer peer.
[[nodiscard]] constexpr std::string_view toString(MessageType type) noexcept {
  return layoutOf(type).name;
}
[[nodiscard]] constexpr std::string_view toString(ConnectStatus status) noexcept {
  const auto at = static_cast<std::size_t>(status);
  return at < kConnectStatusNames.size() ? kConnectStatusNames[at] : "unknown";
}
[[nodiscard]] constexpr std::string_view toString(Fate fate) noexcept {
  const auto at = static_cast<std::size_t>(fate);
  return at < kFateNames.size() ? kFateNames[at] : "unknown";
}

}  // namespace mpf
