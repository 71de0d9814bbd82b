// SPDX-License-Identifier: MIT
#include "router/transport/plain_item.h"

#include <algorithm>
#include <capnp/message.h>
#include <cstring>
#include <span>
#include <tuple>
#include <type_traits>
#include <utility>

#include <mpf/message_of.h>

#include "schema/router.capnp.h"
#include "schema/wire_places.h"

namespace mpf::router {
namespace {

constexpr std::size_t kWordBytes = sizeof(capnp::word);

// Calls `act` with the type of a plain message of this number. Returns false for other types.
template <class Act>
bool withPlainType(MessageType type, Act&& act) {
  switch (type) {
    case MessageType::int32:
      return act(std::type_identity<Int32>());
    case MessageType::float64:
      return act(std::type_identity<Float64>());
    case MessageType::outOfBand:
      return act(std::type_identity<OutOfBand>());
    case MessageType::serialConfig:
      return act(std::type_identity<SerialConfig>());
    default:
      return false;
  }
}

// ---- the schema

// Places of fields in a struct, in bytes of its data section or as the index of a pointer.
class StructPlaces {
 public:
  template <class Struct>
  static StructPlaces of() {
    return StructPlaces(capnp::Schema::from<Struct>());
  }
  std::size_t dataWords, pointers;

  // `size`: bytes of the field
  [[nodiscard]] std::size_t of(const char* field, std::size_t size) const {
    return schema_.getFieldByName(field).getProto().getSlot().getOffset() * size;
  }
  [[nodiscard]] std::size_t bitOf(const char* field) const { return of(field, 1); }
  [[nodiscard]] std::size_t pointerOf(const char* field) const { return of(field, 1); }
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

// A Request or a Reply.
struct CarrierPlaces {
  std::size_t dataWords, pointers;
  std::size_t client, requestId;
  std::size_t takeWithin = 0;  // of a request
  std::size_t isFirst = 0;  // of a reply: its bit
  std::size_t missed = 0;  // of a reply
  std::size_t message;
};

struct Places {
  [[nodiscard]] static const Places& get() {
    static const Places places;
    return places;
  }

  StructPlaces frame = StructPlaces::of<wire::Frame>();
  std::size_t items = frame.pointerOf("items");
  StructPlaces item = StructPlaces::of<wire::Item>();
  std::size_t itemWhich = item.which();
  std::uint16_t requestNumber = item.numberOf("request");
  std::uint16_t replyNumber = item.numberOf("reply");
  std::size_t itemPointer =
      capnp::Schema::from<wire::Item>().getFieldByName("request").getProto().getSlot().getOffset();
  CarrierPlaces request = carrier(StructPlaces::of<wire::Request>());
  CarrierPlaces reply = carrier(StructPlaces::of<wire::Reply>());
  StructPlaces envelope = StructPlaces::of<wire::Envelope>();
  std::size_t envelopeWhich = envelope.which();
  std::size_t clientType = envelope.of("clientType", 4);
  std::size_t clientExtra = envelope.of("clientExtra", 4);
  std::size_t timeStamp = envelope.of("timeStampNs", 8);

  [[nodiscard]] const CarrierPlaces& carrierOf(bool isRequest) const noexcept {
    return isRequest ? request : reply;
  }

 private:
  Places() {
    request.takeWithin = StructPlaces::of<wire::Request>().of("takeWithinNs", 8);
    reply.isFirst = StructPlaces::of<wire::Reply>().bitOf("isFirst");
    reply.missed = StructPlaces::of<wire::Reply>().of("missed", 4);
  }
  static CarrierPlaces carrier(const StructPlaces& of) {
    return {.dataWords = of.dataWords,
            .pointers = of.pointers,
            .client = of.of("client", 4),
            .requestId = of.of("requestId", 4),
            .message = of.pointerOf("message")};
  }
};

// ---- pointers of Cap'n Proto

constexpr std::uint64_t structPointer(std::int64_t offset, std::size_t dataWords,
                                      std::size_t pointers) noexcept {
  return (static_cast<std::uint64_t>(offset) << 2 & UINT32_MAX) | std::uint64_t{dataWords} << 32 |
         std::uint64_t{pointers} << 48;
}
constexpr std::uint64_t compositeListPointer(std::uint64_t offset, std::size_t words) noexcept {
  constexpr std::uint64_t kList = 1;
  constexpr std::uint64_t kComposite = 7;
  return kList | offset << 2 | (kComposite | std::uint64_t{words} << 3) << 32;
}

std::uint64_t toLittle(std::uint64_t value) noexcept {
  std::uint64_t word = 0;
  storeLittle({reinterpret_cast<kj::byte*>(&word), kWordBytes}, 0, value);
  return word;
}

using SegmentWords = kj::ArrayPtr<const capnp::word>;

std::uint64_t wordAt(SegmentWords words, std::size_t at) noexcept {
  return loadLittle<std::uint64_t>(words.asBytes(), at * kWordBytes);
}

// A struct in a segment, with at least the fields that this program has. `data` is empty otherwise.
struct Struct {
  kj::ArrayPtr<const kj::byte> data;
  std::size_t pointers = 0;  // word of the first pointer
  explicit operator bool() const noexcept { return data.size() != 0; }
};

Struct follow(SegmentWords words, std::size_t pointerAt, std::size_t leastData,
              std::size_t leastPointers) noexcept {
  const auto pointer = wordAt(words, pointerAt);
  const auto offset = static_cast<std::int32_t>(static_cast<std::uint32_t>(pointer)) >> 2;
  const auto dataWords = static_cast<std::size_t>(pointer >> 32 & UINT16_MAX);
  const auto pointers = static_cast<std::size_t>(pointer >> 48);
  const auto target = static_cast<std::int64_t>(pointerAt) + 1 + offset;
  const bool fits = (pointer & 3) == 0 && dataWords >= leastData && pointers >= leastPointers &&
                    target >= 0 &&
                    static_cast<std::size_t>(target) + dataWords + pointers <= words.size();
  if (!fits) return {};
  const auto first = static_cast<std::size_t>(target);
  return {words.slice(first, first + dataWords).asBytes(), first + dataWords};
}

// ---- one message

template <class T>
void putFields(kj::ArrayPtr<kj::byte> data, const T& body) {
  const auto& places = WirePlaces<T>::get();
  std::apply(
      [&, i = std::size_t{0}](const auto&... field) mutable {
        (storeLittle(data, places.fields[i++], body.*field.member), ...);
      },
      T::fields());
}

template <class T>
void takeFields(kj::ArrayPtr<const kj::byte> data, T& body) {
  const auto& places = WirePlaces<T>::get();
  const auto takeOne = [&](std::size_t at, auto& value) {
    value = loadLittle<std::remove_cvref_t<decltype(value)>>(data, at);
  };
  std::apply(
      [&, i = std::size_t{0}](const auto&... field) mutable {
        (takeOne(places.fields[i++], body.*field.member), ...);
      },
      T::fields());
}

template <class T>
bool tryTake(SegmentWords words, const Struct& envelope, Message& message) noexcept {
  const auto& places = WirePlaces<T>::get();
  const auto member = follow(words, envelope.pointers + places.memberAt, places.dataWords, 0);
  if (!member) return false;
  T body{};
  takeFields(member.data, body);
  message = MessageOf<T>(body);
  return true;
}

// ---- templates

// The structs of one item, one behind the other.
struct Template {
  std::vector<std::uint64_t> words;
  std::size_t envelope = 0;  // byte of its data
  std::size_t body = 0;
};

template <class T>
Template makeTemplate(bool isRequest) {
  const auto& places = Places::get();
  const auto& carrier = places.carrierOf(isRequest);
  const auto& type = WirePlaces<T>::get();
  const auto envelope = carrier.dataWords + carrier.pointers;
  const auto body = envelope + places.envelope.dataWords + places.envelope.pointers;
  Template made;
  made.words.resize(body + type.dataWords);
  KJ_REQUIRE(made.words.size() <= PlainRun::kMaxItemWords);
  made.envelope = envelope * kWordBytes;
  made.body = body * kWordBytes;
  const auto point = [&](std::size_t at, std::size_t to, std::size_t data, std::size_t pointers) {
    made.words[at] = toLittle(structPointer(
        static_cast<std::int64_t>(to) - static_cast<std::int64_t>(at) - 1, data, pointers));
  };
  point(carrier.dataWords + carrier.message, envelope, places.envelope.dataWords,
        places.envelope.pointers);
  point(envelope + places.envelope.dataWords + type.memberAt, body, type.dataWords, 0);
  kj::ArrayPtr<kj::byte> bytes{reinterpret_cast<kj::byte*>(made.words.data()),
                               made.words.size() * kWordBytes};
  storeLittle(bytes, made.envelope + type.whichAt, type.which);
  return made;
}

template <class T>
const Template& templateOf(bool isRequest) {
  static const std::array<Template, 2> templates{makeTemplate<T>(false), makeTemplate<T>(true)};
  return templates[isRequest ? 1 : 0];
}

}  // namespace

bool PlainItem::canCarry(const Message& message) noexcept {
  return message.isInline() && message.isSound() &&
         withPlainType(message.getType(), [](auto) { return true; });
}

// ---- PlainFrame

std::optional<PlainFrame> PlainFrame::tryOpen(SegmentWords segment) noexcept {
  const auto& places = Places::get();
  if (segment.size() == 0) return std::nullopt;
  const auto root = follow(segment, 0, 0, places.frame.pointers);
  // Its data section is empty, so `root` itself says nothing.
  if (root.pointers == 0) return std::nullopt;
  const auto at = root.pointers + places.items;
  const auto pointer = wordAt(segment, at);
  const auto offset = static_cast<std::int32_t>(static_cast<std::uint32_t>(pointer)) >> 2;
  const auto words = static_cast<std::size_t>(pointer >> 35);
  const auto tagAt = static_cast<std::int64_t>(at) + 1 + offset;
  const bool isComposite = (pointer & 3) == 1 && (pointer >> 32 & 7) == 7;
  if (!isComposite || tagAt < 0 || static_cast<std::size_t>(tagAt) + 1 + words > segment.size())
    return std::nullopt;
  const auto tag = wordAt(segment, static_cast<std::size_t>(tagAt));
  const auto count = static_cast<std::size_t>(static_cast<std::uint32_t>(tag) >> 2);
  const auto dataWords = static_cast<std::size_t>(tag >> 32 & UINT16_MAX);
  const auto stride = dataWords + static_cast<std::size_t>(tag >> 48);
  if ((tag & 3) != 0 || dataWords < places.item.dataWords ||
      stride - dataWords < places.item.pointers || count * stride > words)
    return std::nullopt;
  PlainFrame frame;
  frame.words_ = segment;
  frame.first_ = static_cast<std::size_t>(tagAt) + 1;
  frame.stride_ = stride;
  frame.itemPointer_ = dataWords + places.itemPointer;
  return frame;
}

bool PlainFrame::tryRead(std::uint32_t index, PlainItem& item) const noexcept {
  const auto& places = Places::get();
  const auto at = first_ + index * stride_;
  const auto which =
      loadLittle<std::uint16_t>(words_.asBytes(), at * kWordBytes + places.itemWhich);
  item.isRequest = which == places.requestNumber;
  if (!item.isRequest && which != places.replyNumber) return false;
  const auto& carrier = places.carrierOf(item.isRequest);
  const auto from = follow(words_, at + itemPointer_, carrier.dataWords, carrier.pointers);
  if (!from) return false;
  const auto envelope = follow(words_, from.pointers + carrier.message, places.envelope.dataWords,
                               places.envelope.pointers);
  if (!envelope) return false;
  std::uint32_t missed = 0;
  if (item.isRequest) {
    if (loadLittle<std::uint64_t>(from.data, carrier.takeWithin) != 0) return false;
  } else {
    item.isFirst = (from.data[carrier.isFirst / 8] >> (carrier.isFirst % 8) & 1) != 0;
    missed = loadLittle<std::uint32_t>(from.data, carrier.missed);
  }
  item.client = loadLittle<std::uint32_t>(from.data, carrier.client);
  item.requestId = loadLittle<std::uint32_t>(from.data, carrier.requestId);
  // The members of the union are in the order of MessageType, from 1 on.
  const auto type = loadLittle<std::uint16_t>(envelope.data, places.envelopeWhich) + 1u;
  const bool isPlain =
      type <= UINT16_MAX &&
      withPlainType(static_cast<MessageType>(type), [&]<class T>(std::type_identity<T>) {
        return tryTake<T>(words_, envelope, item.message);
      });
  if (!isPlain) return false;
  item.message.setRoute({0, 0, Message::missedFlags(missed), nullptr});
  item.message.setClientType(loadLittle<std::int32_t>(envelope.data, places.clientType));
  item.message.setClientExtra(loadLittle<std::int32_t>(envelope.data, places.clientExtra));
  item.message.setTimeStampNs(loadLittle<std::int64_t>(envelope.data, places.timeStamp));
  return true;
}

// ---- PlainRun

PlainRun::PlainRun() : payload_(kMaxWords + kMaxItemWords) {}

void PlainRun::clear() noexcept {
  payloadWords_ = 0;
  head_.clear();
  items_.clear();
}

void PlainRun::append(const PlainOutgoing& item) {
  const auto& places = Places::get();
  const auto& carrier = places.carrierOf(item.isRequest);
  const auto at = payloadWords_;
  withPlainType(item.message.getType(), [&]<class T>(std::type_identity<T>) {
    const auto& form = templateOf<T>(item.isRequest);
    std::ranges::copy(form.words, payload_.begin() + static_cast<std::ptrdiff_t>(at));
    payloadWords_ += form.words.size();
    kj::ArrayPtr<kj::byte> bytes{reinterpret_cast<kj::byte*>(payload_.data() + at),
                                 form.words.size() * kWordBytes};
    storeLittle(bytes, carrier.client, item.client);
    storeLittle(bytes, carrier.requestId, item.requestId);
    if (!item.isRequest) {
      if (item.isFirst)
        bytes[carrier.isFirst / 8] |= static_cast<kj::byte>(1u << (carrier.isFirst % 8));
      storeLittle(bytes, carrier.missed, item.message.getMissed());
    }
    storeLittle(bytes, form.envelope + places.clientType, item.message.getClientType());
    storeLittle(bytes, form.envelope + places.clientExtra, item.message.getClientExtra());
    storeLittle(bytes, form.envelope + places.timeStamp, item.message.getTimeStampNs());
    putFields(bytes.slice(form.body, bytes.size()), *item.message.tryAs<T>());
    return true;
  });
  items_.push_back({item.isRequest, item.client, item.requestId, static_cast<std::uint32_t>(at)});
}

void PlainRun::buildHead() {
  const auto& places = Places::get();
  const auto itemWords = places.item.dataWords + places.item.pointers;
  const auto listWords = items_.size() * itemWords;
  const auto rootWords = places.frame.dataWords + places.frame.pointers;
  const auto listAt = 1 + rootWords;  // of the tag
  const auto payloadAt = listAt + 1 + listWords;
  constexpr std::size_t kTable = 1;
  head_.assign(kTable + payloadAt, 0);
  head_[0] = toLittle(std::uint64_t{payloadAt + payloadWords_} << 32);  // one segment
  auto* const words = head_.data() + kTable;
  words[0] = toLittle(structPointer(0, places.frame.dataWords, places.frame.pointers));
  const auto itemsAt = 1 + places.frame.dataWords + places.items;
  words[itemsAt] = toLittle(compositeListPointer(listAt - itemsAt - 1, listWords));
  words[listAt] = toLittle(structPointer(static_cast<std::int64_t>(items_.size()),
                                         places.item.dataWords, places.item.pointers));
  auto* item = words + listAt + 1;
  for (const auto& sent : items_) {
    const auto& carrier = places.carrierOf(sent.isRequest);
    storeLittle({reinterpret_cast<kj::byte*>(item), itemWords * kWordBytes}, places.itemWhich,
                sent.isRequest ? places.requestNumber : places.replyNumber);
    auto* const pointer = item + places.item.dataWords + places.itemPointer;
    const auto target = payloadAt + sent.word;
    *pointer = toLittle(structPointer(static_cast<std::int64_t>(target) - (pointer - words) - 1,
                                      carrier.dataWords, carrier.pointers));
    item += itemWords;
  }
}

}  // namespace mpf::router
