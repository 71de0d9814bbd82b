// SPDX-License-Identifier: MIT
// WirePlaces: the places of the fields of a message type in its Cap'n Proto struct; looked up in
// the schema by name, once.
//
//   struct = | data section: numbers at multiples of their size | pointers |
//   union member = a number in the data section and a pointer
//
// Setting a field by its place costs a store; looking it up by name costs a microsecond for each
// message.
//
// Threads  any number of callers at a time.
// Trust    a struct of another version may be shorter: missing fields read as zero, the default of
//          every field in message.capnp.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <capnp/any.h>
#include <capnp/schema.h>
#include <cstring>
#include <kj/debug.h>

#include <mpf/message_types.h>

#include "schema/message.capnp.h"

namespace mpf {

[[nodiscard]] inline kj::StringPtr toKj(std::string_view literal) {
  return {literal.data(), literal.size()};
}

// Access to numbers of a data section, which are little-endian on every host.
template <class Value>
void storeLittle(kj::ArrayPtr<kj::byte> data, std::size_t at, Value value) {
  auto bytes = std::bit_cast<std::array<kj::byte, sizeof(Value)>>(value);
  if constexpr (std::endian::native == std::endian::big) std::ranges::reverse(bytes);
  std::memcpy(data.begin() + at, bytes.data(), bytes.size());
}
template <class Value>
[[nodiscard]] Value loadLittle(kj::ArrayPtr<const kj::byte> data, std::size_t at) {
  std::array<kj::byte, sizeof(Value)> bytes{};
  if (at + bytes.size() > data.size()) return {};
  std::memcpy(bytes.data(), data.begin() + at, bytes.size());
  if constexpr (std::endian::native == std::endian::big) std::ranges::reverse(bytes);
  return std::bit_cast<Value>(bytes);
}

// The type that represents a value in the Cap'n Proto struct.
template <class Value>
struct Travels {
  using As = Value;
};
template <class Value>
  requires std::is_enum_v<Value>
struct Travels<Value> {
  using As = std::uint16_t;
};
template <>
struct Travels<char> {
  using As = std::uint8_t;
};

// The places in the struct of one type, and of its member in the union of Envelope.
template <class T>
class WirePlaces {
 public:
  static constexpr std::size_t kFields = std::tuple_size_v<decltype(T::fields())>;

  [[nodiscard]] static const WirePlaces& get() {
    static const WirePlaces places;
    return places;
  }

  std::size_t whichAt = 0;  // place of the union's number: byte of the envelope's data section
  std::uint16_t which = 0;  // the number of this type
  capnp::uint memberAt = 0;  // index of the member's pointer
  std::uint16_t dataWords = 0;
  std::uint16_t pointers = 0;
  std::array<std::size_t, kFields> fields{};  // byte of the data section, or index of the pointer
  capnp::uint value = 0;  // elements of an array: index of the pointer

 private:
  using Proto = capnp::schema::Field::Reader;

  WirePlaces() {
    const auto envelope = capnp::Schema::from<wire::Envelope>();
    const auto member = envelope.getFieldByName(toKj(T::kName));
    whichAt = std::size_t{envelope.getProto().getStruct().getDiscriminantOffset()} *
              sizeof(std::uint16_t);
    which = member.getProto().getDiscriminantValue();
    memberAt = member.getProto().getSlot().getOffset();
    const auto schema = member.getType().asStruct();
    dataWords = schema.getProto().getStruct().getDataWordCount();
    pointers = schema.getProto().getStruct().getPointerCount();
    std::size_t at = 0;
    std::apply(
        [&](const auto&... field) {
          ((fields[at++] = place(schema.getFieldByName(toKj(field.name)), field)), ...);
        },
        T::fields());
    if constexpr (ArrayBody<T>)
      value = schema.getFieldByName(toKj(kValueName)).getProto().getSlot().getOffset();
  }

  template <class Body, class Value>
  static std::size_t place(capnp::StructSchema::Field at, const Field<Body, Value>& /*field*/) {
    const auto slot = at.getProto().getSlot();
    KJ_REQUIRE(!slot.getHadExplicitDefault() &&
                   bytesOf(slot.getType()) == sizeof(typename Travels<Value>::As),
               at.getProto().getName());
    return slot.getOffset() * sizeof(typename Travels<Value>::As);
  }
  template <class Body, std::size_t room>
  static std::size_t place(capnp::StructSchema::Field at, const BytesField<Body, room>& /*field*/) {
    return at.getProto().getSlot().getOffset();
  }

  static std::size_t bytesOf(capnp::schema::Type::Reader type) {
    switch (type.which()) {
      case capnp::schema::Type::INT8:
      case capnp::schema::Type::UINT8:
        return 1;
      case capnp::schema::Type::INT16:
      case capnp::schema::Type::UINT16:
      case capnp::schema::Type::ENUM:
        return 2;
      case capnp::schema::Type::INT32:
      case capnp::schema::Type::UINT32:
      case capnp::schema::Type::FLOAT32:
        return 4;
      case capnp::schema::Type::INT64:
      case capnp::schema::Type::UINT64:
      case capnp::schema::Type::FLOAT64:
        return 8;
      default:
        return 0;
    }
  }
};

}  // namespace mpf
