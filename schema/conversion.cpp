// SPDX-License-Identifier: MIT
#include "schema/conversion.h"

#include <kj/exception.h>
#include <limits>

#include <mpf/message_of.h>

#include "schema/visit.h"
#include "schema/wire_places.h"

namespace mpf {

namespace {

using Allocate = std::function<BodyBytes(std::size_t)>;

// Ends a conversion; guarded() catches it.
struct Refusal {
  ConversionFault fault;
  std::string text;
};

void checkBytes(std::size_t bytes, const ConversionLimits& limits) {
  if (bytes > limits.maxValueBytes) {
    throw Refusal{ConversionFault::tooLarge, std::to_string(bytes) + " bytes, the limit is " +
                                                 std::to_string(limits.maxValueBytes)};
  }
}

// ---- one field; `at` is its place in the struct

// A struct that is being converted: its data section and its pointers.
struct Building {
  kj::ArrayPtr<kj::byte> data;
  capnp::List<capnp::AnyPointer>::Builder pointers;
};
struct Reading {
  kj::ArrayPtr<const kj::byte> data;
  capnp::List<capnp::AnyPointer>::Reader pointers;

  template <class Value>
  [[nodiscard]] typename capnp::List<Value>::Reader list(capnp::uint at) const {
    return at < pointers.size() ? pointers[at].getAs<capnp::List<Value>>()
                                : typename capnp::List<Value>::Reader();
  }
  [[nodiscard]] capnp::Data::Reader bytes(std::size_t at) const {
    return at < pointers.size() ? pointers[static_cast<capnp::uint>(at)].getAs<capnp::Data>()
                                : capnp::Data::Reader();
  }
};

template <class Body, class Value>
void put(Building& to, std::size_t at, const Body& body, const Field<Body, Value>& field) {
  const Value value = body.*field.member;
  if constexpr (std::is_enum_v<Value>) {
    const auto number = static_cast<std::int64_t>(value);
    if (number < 0 || number > UINT16_MAX)
      throw Refusal{ConversionFault::unsound,
                    std::to_string(number) + " is not a value of this type"};
  }
  storeLittle(to.data, at, static_cast<typename Travels<Value>::As>(value));
}
template <class Body, std::size_t room>
void put(Building& to, std::size_t at, const Body& body, const BytesField<Body, room>& field) {
  const auto& bytes = body.*field.member;
  to.pointers[static_cast<capnp::uint>(at)].setAs<capnp::Data>(
      capnp::Data::Reader(reinterpret_cast<const capnp::byte*>(bytes.data()), bytes.size()));
}

template <class Body, class Value>
void take(const Reading& from, std::size_t at, Body& body, const Field<Body, Value>& field) {
  body.*field.member = static_cast<Value>(loadLittle<typename Travels<Value>::As>(from.data, at));
}
template <class Body, std::size_t room>
void take(const Reading& from, std::size_t at, Body& body, const BytesField<Body, room>& field) {
  const auto bytes = from.bytes(at);
  if (bytes.size() > room) {
    throw Refusal{
        ConversionFault::malformed,
        std::to_string(bytes.size()) + " bytes, there is room for " + std::to_string(room)};
  }
  if (bytes.size() != 0) std::memcpy((body.*field.member).data(), bytes.begin(), bytes.size());
}

// ---- the elements of an array

template <class Element>
constexpr auto kElementSize =
    sizeof(Element) == 8 ? capnp::ElementSize::EIGHT_BYTES : capnp::ElementSize::FOUR_BYTES;

template <class Element>
void putValue(Building& to, capnp::uint at, std::span<const Element> value,
              const ConversionLimits& limits) {
  checkBytes(value.size_bytes(), limits);
  const auto count = static_cast<capnp::uint>(value.size());
  if constexpr (sizeof(Element) == 1) {
    auto data = to.pointers[at].initAs<capnp::Data>(count);
    if (count != 0) std::memcpy(data.begin(), value.data(), count);
  } else {
    auto list = to.pointers[at].initAs<capnp::List<Element>>(count);
    if constexpr (std::endian::native == std::endian::little) {
      // The memory of the list has the format of the array, so one copy replaces `count` stores (a
      // third of the time).
      const auto raw = capnp::AnyList::Reader(list.asReader()).getRawBytes();
      if (count != 0)
        std::memcpy(const_cast<kj::byte*>(raw.begin()), value.data(), value.size_bytes());
    } else {
      for (capnp::uint i = 0; i < count; ++i) list.set(i, value[i]);
    }
  }
}

template <class T>
MessageOf<T> takeValue(const Reading& from, capnp::uint at, const ConversionLimits& limits,
                       const Allocate& allocate) {
  using Element = typename T::Element;
  const auto elements = [&](std::size_t count) {
    checkBytes(count * sizeof(Element), limits);
    return MessageOf<T>::inBuffer(allocate(MessageOf<T>::bytesFor(count)), count);
  };
  if constexpr (sizeof(Element) == 1) {
    const auto data = from.bytes(at);
    auto message = elements(data.size());
    if (data.size() != 0) std::memcpy(message.value().data(), data.begin(), data.size());
    return message;
  } else {
    const auto list = from.list<Element>(at);
    auto message = elements(list.size());
    const auto value = message.value();
    const capnp::AnyList::Reader any(list);
    if (std::endian::native == std::endian::little &&
        any.getElementSize() == kElementSize<Element>) {
      if (list.size() != 0)
        std::memcpy(value.data(), any.getRawBytes().begin(), value.size_bytes());
    } else {  // another byte order, or a list of structs from a newer peer
      for (capnp::uint i = 0; i < list.size(); ++i) value[i] = list[i];
    }
    return message;
  }
}

// ---- one type; `at` is the name of the current field, for the error

template <class T>
void toWire(const Message& message, capnp::AnyStruct::Builder envelope,
            const ConversionLimits& limits, std::string_view& at) {
  const auto& places = WirePlaces<T>::get();
  if (!message.isSound())
    throw Refusal{ConversionFault::unsound,
                  "a body of " + std::to_string(message.body().size()) + " bytes is invalid"};
  const T body = *message.tryAs<T>();
  storeLittle(envelope.getDataSection(), places.whichAt, places.which);
  auto into = envelope.getPointerSection()[places.memberAt].initAsAnyStruct(places.dataWords,
                                                                            places.pointers);
  Building to{into.getDataSection(), into.getPointerSection()};
  const auto putOne = [&](std::size_t where, const auto& field) {
    at = field.name;
    put(to, where, body, field);
  };
  std::apply([&, i = std::size_t{0}](
                 const auto&... field) mutable { (putOne(places.fields[i++], field), ...); },
             T::fields());
  if constexpr (ArrayBody<T>) {
    at = kValueName;
    putValue(to, places.value, message.valueAs<T>(), limits);
  }
}

template <class T>
Message fromWire(capnp::AnyStruct::Reader envelope, const ConversionLimits& limits,
                 const Allocate& allocate, std::string_view& at) {
  const auto& places = WirePlaces<T>::get();
  const auto members = envelope.getPointerSection();
  capnp::AnyStruct::Reader member;
  if (places.memberAt < members.size())
    member = members[places.memberAt].template getAs<capnp::AnyStruct>();
  const Reading from{member.getDataSection(), member.getPointerSection()};
  const auto takeFields = [&](T& body) {
    const auto takeOne = [&](std::size_t where, const auto& field) {
      at = field.name;
      take(from, where, body, field);
    };
    std::apply([&, i = std::size_t{0}](
                   const auto&... field) mutable { (takeOne(places.fields[i++], field), ...); },
               T::fields());
  };
  if constexpr (ArrayBody<T>) {
    at = kValueName;
    auto message = takeValue<T>(from, places.value, limits, allocate);
    takeFields(*message);
    return message;
  } else {
    T body{};
    takeFields(body);
    return MessageOf<T>(body);
  }
}

// Runs `convert`. Returns false with `error` set if it throws; onKjException is the fault of a
// kj::Exception.
template <class Convert>
bool guarded(std::string_view type, const std::string_view& at, ConversionFault onKjException,
             ConversionError& error, Convert&& convert) {
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
    return fail(onKjException, {why.begin(), why.size()});
  }
}

}  // namespace

capnp::ReaderOptions ConversionLimits::readerOptions() const noexcept {
  constexpr std::uint64_t kFieldsWords = 64;
  return {.traversalLimitInWords = maxValueBytes / sizeof(capnp::word) + kFieldsWords,
          .nestingLimit = 8};
}

bool tryToWire(const Message& message, wire::Envelope::Builder envelope,
               const ConversionLimits& limits, ConversionError& error) {
  error = {};
  envelope.setClientType(message.getClientType());
  envelope.setClientExtra(message.getClientExtra());
  envelope.setTimeStampNs(message.getTimeStampNs());
  bool known = false;
  const bool done = withType(message.getType(), [&]<class T>(std::type_identity<T>) {
    known = true;
    std::string_view at;
    return guarded(T::kName, at, ConversionFault::tooLarge, error,
                   [&] { toWire<T>(message, capnp::toAny(envelope), limits, at); });
  });
  if (!known) {
    error = {ConversionFault::unknownType,
             "type " + std::to_string(static_cast<unsigned>(message.getType())) + " is unknown"};
  }
  return done;
}

std::optional<Message> tryFromWire(wire::Envelope::Reader envelope, const ConversionLimits& limits,
                                   ConversionError& error, const Allocate& allocate) {
  error = {};
  // The members of the union are in the order of MessageType, from 1 on; message_types_test checks
  // this.
  const auto number = static_cast<unsigned>(envelope.which()) + 1;
  bool known = false;
  std::optional<Message> result;
  withType(static_cast<MessageType>(std::min<unsigned>(number, UINT16_MAX)),
           [&]<class T>(std::type_identity<T>) {
             known = true;
             std::string_view at;
             return guarded(T::kName, at, ConversionFault::malformed, error, [&] {
               result = fromWire<T>(capnp::toAny(envelope), limits, allocate, at);
             });
           });
  if (!known)
    error = {ConversionFault::unknownType,
             "type " + std::to_string(number) + " is unknown: the peer is newer"};
  if (result) {
    result->setClientType(envelope.getClientType());
    result->setClientExtra(envelope.getClientExtra());
    result->setTimeStampNs(envelope.getTimeStampNs());
  }
  return result;
}

}  // namespace mpf
