// SPDX-License-Identifier: MIT
#include "router/transport/plain_form.h"

#include <kj/debug.h>

#include "schema/router.capnp.h"
#include "schema/wire_places.h"

namespace mpf::router {
namespace {

// Places of fields in a struct, in bytes of its data section or as the index of a pointer.
class StructPlaces {
 public:
  template <class Struct>
  static StructPlaces of() {
    return StructPlaces(capnp::Schema::from<Struct>());
  }
  std::size_t dataWords, pointers;
  [[nodiscard]] std::size_t words() const { return dataWords + pointers; }

  // `size`: bytes of the field
  [[nodiscard]] std::size_t byteOf(const char* field, std::size_t size) const {
    return schema_.getFieldByName(field).getProto().getSlot().getOffset() * size;
  }
  [[nodiscard]] std::size_t bitOf(const char* field) const { return byteOf(field, 1); }
  [[nodiscard]] std::size_t pointerOf(const char* field) const { return byteOf(field, 1); }
  [[nodiscard]] std::size_t which() const {
    return schema_.getProto().getStruct().getDiscriminantOffset() * sizeof(std::uint16_t);
  }
  [[nodiscard]] std::uint16_t numberOf(const char* field) const {
    return schema_.getFieldByName(field).getProto().getDiscriminantValue();
  }

 private:
  explicit StructPlaces(capnp::StructSchema schema)
      : dataWords(schema.getProto().getStruct().getDataWordCount()),
        pointers(schema.getProto().getStruct().getPointerCount()),
        schema_(schema) {}

  capnp::StructSchema schema_;
};

template <class T>
PlainForm formOf(const StructPlaces& carrier, const StructPlaces& envelope) {
  const auto& type = WirePlaces<T>::get();
  static_assert(WirePlaces<T>::kFields <= PlainForm::kMostFields);
  const auto envelopeAt = carrier.words();
  const auto messageAt = envelopeAt + envelope.words();
  PlainForm form;
  form.count = messageAt + type.dataWords;
  KJ_REQUIRE(form.count <= form.words.size() && type.pointers == 0);
  const auto point = [&](std::size_t at, std::size_t to, std::size_t data, std::size_t pointers) {
    form.words[at] =
        toLittle(structPointer(static_cast<std::int64_t>(to - at) - 1, data, pointers));
    return at;
  };
  form.toEnvelope = point(carrier.dataWords + carrier.pointerOf("message"), envelopeAt,
                          envelope.dataWords, envelope.pointers);
  form.toMessage =
      point(envelopeAt + envelope.dataWords + type.memberAt, messageAt, type.dataWords, 0);
  const auto data = envelopeAt * kWordBytes;
  storeLittle(kj::arrayPtr(form.words.data(), form.words.size()).asBytes(), data + type.whichAt,
              type.which);
  form.client = carrier.byteOf("client", 4);
  form.requestId = carrier.byteOf("requestId", 4);
  form.clientType = data + envelope.byteOf("clientType", 4);
  form.clientExtra = data + envelope.byteOf("clientExtra", 4);
  form.timeStamp = data + envelope.byteOf("timeStampNs", 8);
  for (std::size_t field = 0; field < WirePlaces<T>::kFields; ++field)
    form.fields[field] = messageAt * kWordBytes + type.fields[field];
  return form;
}

PlainForms::Kind kindOf(std::uint16_t number, const StructPlaces& carrier) {
  const auto envelope = StructPlaces::of<wire::Envelope>();
  PlainForms::Kind kind;
  kind.number = number;
  kind.shape = structPointer(0, carrier.dataWords, carrier.pointers) >> 32;
  kind.typeByte = carrier.words() * kWordBytes + envelope.which();
  kind.wordsWithoutMessage = carrier.words() + envelope.words();
  for (std::size_t type = 0; type < kind.forms.size(); ++type) {
    withPlainType(static_cast<MessageType>(type), [&]<class T>(std::type_identity<T>) {
      kind.forms[type] = formOf<T>(carrier, envelope);
      return true;
    });
  }
  return kind;
}

}  // namespace

std::uint64_t toLittle(std::uint64_t value) noexcept {
  std::uint64_t word = 0;
  storeLittle({reinterpret_cast<kj::byte*>(&word), kWordBytes}, 0, value);
  return word;
}

PlainForms::PlainForms() {
  const auto frame = StructPlaces::of<wire::Frame>();
  const auto item = StructPlaces::of<wire::Item>();
  const auto requests = StructPlaces::of<wire::Request>();
  const auto replies = StructPlaces::of<wire::Reply>();
  request = kindOf(item.numberOf("request"), requests);
  reply = kindOf(item.numberOf("reply"), replies);
  for (auto& form : request.forms) form.takeWithin = requests.byteOf("takeWithinNs", 8);
  for (auto& form : reply.forms) {
    form.isFirstBit = replies.bitOf("isFirst");
    form.missed = replies.byteOf("missed", 4);
  }
  root = structPointer(0, frame.dataWords, frame.pointers);
  frameWords = frame.words();
  list = 1 + frame.dataWords + frame.pointerOf("items");
  itemData = item.dataWords;
  itemPointers = item.pointers;
  kindByte = item.which();
  itemPointer = item.dataWords + item.pointerOf("request");
}

}  // namespace mpf::router
