// SPDX-License-Identifier: MIT
// Message types: the body of each type of message in shared memory, with a description of its
// fields, from which sizes, checks, printing, parsing and the wire format are derived.
//
//   scalar   | Int32: fields |
//   array    | Int32Array: fields, length | value[0] | value[1] | ...   elements aligned to 8 bytes
//
// The structs have fixed widths and the byte order of the host: client and server share memory.
// Routers send the structs of message.capnp to other hosts instead.
//
// All fields are 0 by default. A client writes the fields of a request. A server changes the
// request and replies with it, so that the other fields return unchanged, or fills in a new reply,
// whose fields are 0. `reserved` fields are padding: they are 0, and readers ignore them. MPF does
// not act on fields of messages between client and server; reports show the `cmd` that a server is
// busy with.
//
// An array has 0 or more elements; ServerOptions::maxMessageBytes limits the body, fields included.
//
// CONTRIBUTING.md describes how to add a type. schema_test compares the structs with message.capnp.
//
// Threads  plain data; the owner of the message handle is the only user of a body in this process.
// Throws   nothing in this header throws or allocates.
// Trust    a peer may write to a body while it is read: never use the field `length` as the length
//          of an array. MessageOf::value() uses the size of the body.
// Source   manual, "Message", "StandardFieldsMessage" and the section of each type; types and
//          fields have the names of the manual.
#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <tuple>
#include <type_traits>

#include <mpf/detail/cpp20.h>

namespace mpf {

// The number of a type, in shared memory. Numbers are never reused. A newer peer may send a number
// that is not listed here: <mpf/message_layout.h> accepts every number.
enum class MessageType : std::uint16_t {
  none = 0,  // of an empty handle; never sent
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

// The status of a ConnectMessage (manual, "ConnectMessage"). Clients of the original MPF treat
// every value other than connectYes as a disconnect.
enum class ConnectStatus : std::int32_t {
  // Disconnected, after a connectYes. All requests have ended before, each with its reply or fate.
  // The client reconnects automatically.
  connectNo = 0,
  connectYes = 1,  // connected: messages reach the server
  // A queue was full and refused a message, here or on the host of the server. The client stays
  // connected; a run of refusals is reported once.
  connectQueueFull = 2,
  // The server has 16384 clients, the maximum; the client tries again every second.
  connectRefused = 3,
};
// Indexed by the value of the status.
inline constexpr std::array<std::string_view, 4> kConnectStatusNames{
    "connectNo", "connectYes", "connectQueueFull", "connectRefused"};

// How a request without a reply ended. "Taken" means: removed from the queue by the server. Each
// request that was sent ends in one reply or in one fate. Only after neverTaken and expired is it
// certain that the server has done nothing, so that the request can be repeated.
enum class Fate : std::int32_t {
  // The server did not accept it (full queue, size, type), or destroyed it without a reply, for
  // example because its handler threw an exception.
  refused = 0,
  neverTaken = 1,  // the connection ended before the server took it: nothing was done
  // The server took it, or may have taken it, and no reply followed: the connection ended, the
  // timeout of SyncClient::call() passed, or the client had no memory to receive the reply. It may
  // have been done.
  outcomeUnknown = 2,
  expired = 3,  // its deadline passed before the server took it: nothing was done
  // The client called cancel(); the server may still act on it. A late reply is dropped.
  cancelled = 4,
};
// Indexed by the value of the fate.
inline constexpr std::array<std::string_view, 5> kFateNames{
    "refused", "neverTaken", "outcomeUnknown", "expired", "cancelled"};
inline constexpr std::array<std::string_view, 5> kFateMeanings{
    "the server has no handler for messages of this type, or dropped the request",
    "the server ended before it took the request: nothing was done",
    "the server may have taken the request and carried it out",
    "the server did not take the request in time: nothing was done",
    "the client cancelled the request"};

// ---- the description of a type: each T has kType, kName and fields(), and arrays have Element

// A field: its name, which is the same in message.capnp, in texts and in JSON, and the member.
template <class Body, class Value>
struct Field {
  std::string_view name;
  Value Body::* member;
};
template <class Body, class Value>
Field(std::string_view, Value Body::*) -> Field<Body, Value>;

// A short byte string inside the struct, without a terminator; the member `used` is the number of
// bytes in use, which readers limit to 0 to `room`.
template <class Body, std::size_t room>
struct BytesField {
  std::string_view name;
  std::array<char, room> Body::* member;
  std::int32_t Body::* used;
};
template <class Body, std::size_t room>
BytesField(std::string_view, std::array<char, room> Body::*, std::int32_t Body::*)
    -> BytesField<Body, room>;

// The five fields that most types have; client and server agree on their meaning (manual,
// "StandardFieldsMessage"). MPF does not act on them: a `timeout` does not end a request, only the
// deadline of MessageClient::send() does. Each field, and the end that writes it:
//   timeout   client  how long the server may wait for its device, in seconds by convention
//   cmd       client  a command; servers declare theirs in a header such as <mpf/serial_commands.h>
//   status    server  of a reply, 0 by convention when the request succeeded; the device servers of
//                     MPF reply -1 to a request of a type that they do not handle, or refuse it if
//                     the type has no status
//   address   client  for example the channel
//   extra     both    anything else
template <class Body>
constexpr auto standardFields() {
  return std::tuple{Field{"timeout", &Body::timeout}, Field{"cmd", &Body::cmd},
                    Field{"status", &Body::status}, Field{"address", &Body::address},
                    Field{"extra", &Body::extra}};
}

// The name of the value, or of the elements of an array, in message.capnp and in texts.
inline constexpr std::string_view kValueName = "value";

// ---- the types

// MPF sends it to a client when the connection is made or broken, or when a queue was full (manual,
// "ConnectMessage"). Programs do not send it: a client disconnects from a server that sends it as a
// reply.
struct Connect {
  ConnectStatus status{};
  std::uint32_t reserved{};
  // Of the server, written by the client library; another number than before means that the server
  // was restarted.
  std::uint64_t incarnation{};

  static constexpr auto kType = MessageType::connect;
  static constexpr std::string_view kName = "connect";
  static constexpr auto fields() {
    return std::tuple{Field{"status", &Connect::status},
                      Field{"incarnation", &Connect::incarnation}};
  }
};

// One 32-bit integer; the server defines its unit, for example counts (manual, "Int32Message").
struct Int32 {
  std::int32_t timeout{}, cmd{}, status{}, address{}, extra{}, value{};

  static constexpr auto kType = MessageType::int32;
  static constexpr std::string_view kName = "int32";
  static constexpr auto fields() {
    return std::tuple_cat(standardFields<Int32>(), std::tuple{Field{kValueName, &Int32::value}});
  }
};

// 32-bit integers, which follow the fields: MessageOf::value() (manual, "Int32ArrayMessage").
struct Int32Array {
  std::int32_t timeout{}, cmd{}, status{}, address{}, extra{};
  std::uint32_t length{};  // number of elements that follow; written by setLength() only

  using Element = std::int32_t;
  static constexpr auto kType = MessageType::int32Array;
  static constexpr std::string_view kName = "int32Array";
  static constexpr auto fields() { return standardFields<Int32Array>(); }
};

// One double, NaN and infinities included, in a unit of the server (manual, "Float64Message").
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

// Doubles, which follow the fields: MessageOf::value() (manual, "Float64ArrayMessage").
struct alignas(8) Float64Array {
  std::int32_t timeout{}, cmd{}, status{}, address{}, extra{};
  std::uint32_t length{};  // number of elements that follow; written by setLength() only

  using Element = double;
  static constexpr auto kType = MessageType::float64Array;
  static constexpr std::string_view kName = "float64Array";
  static constexpr auto fields() { return standardFields<Float64Array>(); }
};

// Bytes or text, which MPF does not interpret (manual, "Char8ArrayMessage"). A text has no
// terminating zero unless the sender counts one. <mpf/serial_commands.h> describes what serial
// servers read and write.
struct Char8Array {
  std::int32_t timeout{}, cmd{}, status{}, address{}, extra{};
  std::uint32_t length{};  // number of bytes that follow; written by setSize() only
  // How often the server repeats a command that failed; a negative number counts as 0. Written by
  // the client; serial servers limit it (--max-retries).
  std::int32_t numberRetrys{};
  std::int32_t eomLen{};  // [bytes] length of the end-of-message string, 0 to 4
  // The end-of-message string, without a terminator. Serial servers use it only in a request with
  // cmdSetEom, and only its first two bytes.
  std::array<char, 4> eomString{};
  std::uint32_t reserved{};

  // The end-of-message string, valid as long as this struct. Limits eomLen, which a peer may have
  // written, to 0 to 4.
  [[nodiscard]] std::string_view eom() const noexcept {
    // Read once: a peer may change it between two reads.
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

// Settings of a serial line; 0 in a field keeps the present setting (manual,
// "SerialConfigMessage"). The client writes all fields. The reply is an Int32 message with a
// status: 0, or serialServerStatusError when the line does not accept one of the values or is
// unplugged; then no setting has changed.
struct SerialConfig {
  std::int32_t baud{};  // [bit/s] positive; each kind of line has its own limits
  std::int32_t stopBits{};  // 1 or 2
  std::int32_t bitsPerChar{};  // 5 to 8
  char parity{};  // 'E' even, 'O' odd, 'N' none
  char flowControl{};  // 'H' hardware (RTS/CTS), 'N' none
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

// Like Int32; a server sends it to a client as a message that answers no request (manual,
// "OutOfBandMessage"). It needs the route of a request of that client, so the server allocates it
// with allocReplyMessage(), and sends it after the reply. If it is sent before, it is the reply,
// and ends the request.
struct OutOfBand {
  std::int32_t timeout{}, cmd{}, status{}, address{}, extra{}, value{};

  static constexpr auto kType = MessageType::outOfBand;
  static constexpr std::string_view kName = "outOfBand";
  static constexpr auto fields() {
    return std::tuple_cat(standardFields<OutOfBand>(),
                          std::tuple{Field{kValueName, &OutOfBand::value}});
  }
};

// MPF sends it to a client: how a request without a reply ended. The message has the clientType and
// the clientExtra of the request. Programs do not send it; a server calls MessageServer::refuse().
struct RequestFate {
  Fate fate{};
  std::uint32_t requestId{};  // the number that MessageClient::send() gave to the request

  static constexpr auto kType = MessageType::requestFate;
  static constexpr std::string_view kName = "requestFate";
  static constexpr auto fields() {
    return std::tuple{Field{"fate", &RequestFate::fate},
                      Field{"requestId", &RequestFate::requestId}};
  }
};

// A Cap'n Proto message of the user's own schema, in standard segment framing, readable in place:
// see <mpf/user_message.h>. MPF forwards it and does not interpret it. It has no standard fields.
struct alignas(8) User {
  std::uint32_t length{};  // number of bytes that follow; written by setSize() only
  std::uint32_t reserved{};

  using Element = std::byte;
  static constexpr auto kType = MessageType::user;
  static constexpr std::string_view kName = "user";
  static constexpr auto fields() { return std::tuple<>{}; }
};

// All types, in the order of their numbers, which start at 1.
using MessageTypes = std::tuple<Connect, Int32, Int32Array, Float64, Float64Array, Char8Array,
                                SerialConfig, OutOfBand, RequestFate, User>;

static_assert(sizeof(Connect) == 16 && sizeof(Int32) == 24 && sizeof(Float64) == 32 &&
              sizeof(SerialConfig) == 16);
static_assert(sizeof(OutOfBand) == 24 && sizeof(RequestFate) == 8);
static_assert(sizeof(Int32Array) == 24 && sizeof(Float64Array) == 24 && sizeof(Char8Array) == 40 &&
              sizeof(User) == 8);

// ---- kinds of types

// A body with elements behind its fields.
template <class T>
concept ArrayBody = requires { typename T::Element; };

// Any body.
template <class T>
concept MessageBody = requires {
  { T::kType } -> std::convertible_to<MessageType>;
} && std::is_trivially_copyable_v<T>;

// A body of fixed size.
template <class T>
concept ScalarBody = MessageBody<T> && !ArrayBody<T>;

// An array of bytes: its handle has setSize(), as in the manual ("Char8ArrayMessage").
template <class T>
concept CountedInBytes = ArrayBody<T> && sizeof(typename T::Element) == 1;

// An array of numbers: its handle has setLength(), as in the manual ("Int32ArrayMessage").
template <class T>
concept CountedInElements = ArrayBody<T> && !CountedInBytes<T>;

// The name of a status or a fate, as in texts and JSON; "unknown" for a value that only newer
// programs have. <mpf/message_layout.h> has that of a type. Valid until the process exits.
[[nodiscard]] constexpr std::string_view toString(ConnectStatus status) noexcept {
  const auto at = static_cast<std::size_t>(status);
  return at < kConnectStatusNames.size() ? kConnectStatusNames[at] : "unknown";
}
[[nodiscard]] constexpr std::string_view toString(Fate fate) noexcept {
  const auto at = static_cast<std::size_t>(fate);
  return at < kFateNames.size() ? kFateNames[at] : "unknown";
}
// What the fate says about the request, for people.
[[nodiscard]] constexpr std::string_view meaningOf(Fate fate) noexcept {
  const auto at = static_cast<std::size_t>(fate);
  return at < kFateMeanings.size() ? kFateMeanings[at] : "unknown";
}

}  // namespace mpf
