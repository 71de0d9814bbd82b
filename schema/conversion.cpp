// SPDX-License-Identifier: MIT
#include <mpf/schema/conversion.h>

#include <capnp/dynamic.h>
#include <kj/exception.h>
#include <limits>

#include <mpf/schema/visit.h>

namespace mpf {

namespace {

using WireField = capnp::StructSchema::Field;

kj::StringPtr toKj(std::string_view literal) { return {literal.data(), literal.size()}; }

// Where the fields of T are in message.capnp; found by name, once.
template <class T>
struct WireOf {
  static constexpr std::size_t kFields = std::tuple_size_v<decltype(T::fields())>;

  WireField member = capnp::Schema::from<wire::Envelope>().getFieldByName(toKj(T::kName));
  capnp::StructSchema schema = member.getType().asStruct();
  std::array<WireField, kFields> fields = std::apply(
      [this](const auto&... field) { return std::array<WireField, kFields>{schema.getFieldByName(toKj(field.name))...}; }, T::fields());

  [[nodiscard]] static const WireOf& get() {
    static const WireOf wire;
    return wire;
  }
  [[nodiscard]] WireField value() const { return schema.getFieldByName(toKj(kValueName)); }
};

// Ends a conversion from within.
struct Refusal {
  ConversionFault fault;
  std::string text;
};

void checkBytes(std::size_t bytes, const ConversionLimits& limits) {
  if (bytes > limits.maxValueBytes) {
    throw Refusal{ConversionFault::tooLarge, std::to_string(bytes) + " bytes, the limit is " + std::to_string(limits.maxValueBytes)};
  }
}

// ---- one field

template <class Body, class Value>
void put(capnp::DynamicStruct::Builder& to, WireField at, const Body& body, const Field<Body, Value>& field) {
  const Value value = body.*field.member;
  if constexpr (std::is_enum_v<Value>) {
    const auto number = static_cast<std::int64_t>(value);
    if (number < 0 || number > UINT16_MAX) throw Refusal{ConversionFault::unsound, std::to_string(number) + " is no such value"};
    to.set(at, capnp::DynamicEnum(at.getType().asEnum(), static_cast<std::uint16_t>(number)));
  } else if constexpr (std::is_same_v<Value, char>) {
    to.set(at, static_cast<std::uint8_t>(value));
  } else {
    to.set(at, value);
  }
}
template <class Body, std::size_t room>
void put(capnp::DynamicStruct::Builder& to, WireField at, const Body& body, const BytesField<Body, room>& field) {
  const auto& bytes = body.*field.member;
  to.set(at, capnp::Data::Reader(reinterpret_cast<const capnp::byte*>(bytes.data()), bytes.size()));
}

template <class Body, class Value>
void take(const capnp::DynamicStruct::Reader& from, WireField at, Body& body, const Field<Body, Value>& field) {
  if constexpr (std::is_enum_v<Value>) {
    body.*field.member = static_cast<Value>(from.get(at).as<capnp::DynamicEnum>().getRaw());
  } else if constexpr (std::is_same_v<Value, char>) {
    body.*field.member = static_cast<char>(from.get(at).as<std::uint8_t>());
  } else {
    body.*field.member = from.get(at).as<Value>();
  }
}
template <class Body, std::size_t room>
void take(const capnp::DynamicStruct::Reader& from, WireField at, Body& body, const BytesField<Body, room>& field) {
  const auto bytes = from.get(at).as<capnp::Data>();
  if (bytes.size() > room) {
    throw Refusal{ConversionFault::malformed, std::to_string(bytes.size()) + " bytes, there is room for " + std::to_string(room)};
  }
  if (bytes.size() != 0) std::memcpy((body.*field.member).data(), bytes.begin(), bytes.size());
}

// ---- the elements of an array

template <class Element>
void putValue(capnp::DynamicStruct::Builder& to, WireField at, std::span<const Element> value, const ConversionLimits& limits) {
  checkBytes(value.size_bytes(), limits);
  const auto count = static_cast<capnp::uint>(value.size());
  if constexpr (sizeof(Element) == 1) {
    auto data = to.init(at, count).template as<capnp::Data>();
    if (count != 0) std::memcpy(data.begin(), value.data(), count);
  } else {
    auto list = to.init(at, count).template as<capnp::DynamicList>().template as<capnp::List<Element>>();
    for (capnp::uint i = 0; i < count; ++i) list.set(i, value[i]);
  }
}

template <class T>
MessageOf<T> takeValue(const capnp::DynamicStruct::Reader& from, WireField at, const ConversionLimits& limits) {
  using Element = typename T::Element;
  if constexpr (sizeof(Element) == 1) {
    const auto data = from.get(at).template as<capnp::Data>();
    checkBytes(data.size(), limits);
    auto message = MessageOf<T>::allocValue(data.size());
    if (data.size() != 0) std::memcpy(message.value().data(), data.begin(), data.size());
    return message;
  } else {
    const auto list = from.get(at).template as<capnp::DynamicList>().template as<capnp::List<Element>>();
    checkBytes(std::size_t{list.size()} * sizeof(Element), limits);
    auto message = MessageOf<T>::allocValue(list.size());
    const auto value = message.value();
    for (capnp::uint i = 0; i < list.size(); ++i) value[i] = list[i];
    return message;
  }
}

// ---- one type; `at` is the field being converted, for the error

template <class T>
void toWire(const Message& message, capnp::DynamicStruct::Builder envelope, const ConversionLimits& limits, std::string_view& at) {
  const auto& wire = WireOf<T>::get();
  if (!message.isSound()) throw Refusal{ConversionFault::unsound, "a body of " + std::to_string(message.body().size()) + " bytes is none"};
  const T body = *message.tryAs<T>();
  auto to = envelope.init(wire.member).template as<capnp::DynamicStruct>();
  const auto putOne = [&](WireField where, const auto& field) {
    at = field.name;
    put(to, where, body, field);
  };
  std::apply([&, i = std::size_t{0}](const auto&... field) mutable { (putOne(wire.fields[i++], field), ...); }, T::fields());
  if constexpr (ArrayBody<T>) {
    at = kValueName;
    putValue(to, wire.value(), message.valueAs<T>(), limits);
  }
}

template <class T>
Message fromWire(const capnp::DynamicStruct::Reader& envelope, const ConversionLimits& limits, std::string_view& at) {
  const auto& wire = WireOf<T>::get();
  const auto from = envelope.get(wire.member).template as<capnp::DynamicStruct>();
  const auto takeFields = [&](T& body) {
    const auto takeOne = [&](WireField where, const auto& field) {
      at = field.name;
      take(from, where, body, field);
    };
    std::apply([&, i = std::size_t{0}](const auto&... field) mutable { (takeOne(wire.fields[i++], field), ...); }, T::fields());
  };
  if constexpr (ArrayBody<T>) {
    at = kValueName;
    auto message = takeValue<T>(from, wire.value(), limits);
    takeFields(*message);
    return message;
  } else {
    T body{};
    takeFields(body);
    return MessageOf<T>(body);
  }
}

// Runs `convert`, and says what stopped it.
template <class Convert>
bool guarded(std::string_view type, const std::string_view& at, ConversionFault onNonsense, ConversionError& error, Convert&& convert) {
  const auto fail = [&](ConversionFault fault, std::string_view why) {
    error.fault = fault;
    error.text.assign(type).append(at.empty() ? "" : ".").append(at).append(": ").append(why);
    return false;
  };
  try {
    convert();
    return true;
  } catch (const Refusal& refusal) {
    return fail(refusal.fault, refusal.text);
  } catch (const kj::Exception& exception) {
    const auto why = exception.getDescription();
    return fail(onNonsense, {why.begin(), why.size()});
  }
}

}  // namespace

capnp::ReaderOptions ConversionLimits::readerOptions() const noexcept {
  constexpr std::uint64_t kFieldsWords = 64;
  return {.traversalLimitInWords = maxValueBytes / sizeof(capnp::word) + kFieldsWords, .nestingLimit = 8};
}

bool tryToWire(const Message& message, wire::Envelope::Builder envelope, const ConversionLimits& limits, ConversionError& error) {
  error = {};
  envelope.setClientType(message.getClientType());
  envelope.setClientExtra(message.getClientExtra());
  bool known = false;
  const bool done = withType(message.getType(), [&]<class T>(std::type_identity<T>) {
    known = true;
    std::string_view at;
    return guarded(T::kName, at, ConversionFault::tooLarge, error, [&] { toWire<T>(message, envelope, limits, at); });
  });
  if (!known) {
    error = {ConversionFault::unknownType, "type " + std::to_string(static_cast<unsigned>(message.getType())) + " is none of ours"};
  }
  return done;
}

std::optional<Message> tryFromWire(wire::Envelope::Reader envelope, const ConversionLimits& limits, ConversionError& error) {
  error = {};
  // The union's members stand in the order of MessageType, from 1 on; message_types_test holds them to it.
  const auto number = static_cast<unsigned>(envelope.which()) + 1;
  bool known = false;
  std::optional<Message> result;
  withType(static_cast<MessageType>(std::min<unsigned>(number, UINT16_MAX)), [&]<class T>(std::type_identity<T>) {
    known = true;
    std::string_view at;
    return guarded(T::kName, at, ConversionFault::malformed, error, [&] { result = fromWire<T>(envelope, limits, at); });
  });
  if (!known) error = {ConversionFault::unknownType, "type " + std::to_string(number) + " is none of ours: the peer is newer"};
  if (result) {
    result->setClientType(envelope.getClientType());
    result->setClientExtra(envelope.getClientExtra());
  }
  return result;
}

}  // namespace mpf
