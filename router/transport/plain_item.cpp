// SPDX-License-Identifier: MIT
#include "router/transport/plain_item.h"

#include <bit>
#include <capnp/message.h>
#include <cstring>
#include <span>
#include <tuple>
#include <type_traits>
#include <utility>

#include <mpf/message_of.h>

#include "router/transport/plain_form.h"
#include "schema/wire_places.h"

namespace mpf::router {
namespace {

constexpr std::uint64_t compositeListPointer(std::uint64_t offset, std::size_t words) noexcept {
  constexpr std::uint64_t kList = 1;
  constexpr std::uint64_t kComposite = 7;
  return kList | offset << 2 | (kComposite | std::uint64_t{words} << 3) << 32;
}

using SegmentWords = kj::ArrayPtr<const capnp::word>;

std::uint64_t wordAt(SegmentWords words, std::size_t at) noexcept {
  return loadLittle<std::uint64_t>(words.asBytes(), at * kWordBytes);
}

// ---- bodies

template <class Value>
Value numberAt(const kj::byte* bytes) {
  return loadLittle<Value>(kj::arrayPtr(bytes, sizeof(Value)), 0);
}

template <class Value>
void putNumber(kj::byte* bytes, Value value) {
  storeLittle(kj::arrayPtr(bytes, sizeof value), 0, value);
}

template <class T>
void putBody(kj::byte* item, const PlainForm& form, const std::byte* from) {
  T body;
  std::memcpy(&body, from, sizeof body);
  std::apply(
      [&, i = std::size_t{0}](const auto&... field) mutable {
        (putNumber(item + form.fields[i++], body.*field.member), ...);
      },
      T::fields());
}

template <class T>
T bodyOf(const kj::byte* item, const PlainForm& form) {
  T body{};
  const auto takeOne = [&](std::size_t at, auto& value) {
    value = numberAt<std::remove_cvref_t<decltype(value)>>(item + at);
  };
  std::apply(
      [&, i = std::size_t{0}](const auto&... field) mutable {
        (takeOne(form.fields[i++], body.*field.member), ...);
      },
      T::fields());
  return body;
}

}  // namespace

bool PlainItem::canCarry(const Message& message) noexcept {
  return message.isInline() && message.isSound() &&
         withPlainType(message.getType(), [](auto) { return true; });
}

// ---- PlainFrame

std::optional<PlainFrame> PlainFrame::tryOpen(SegmentWords segment) noexcept {
  const auto& forms = PlainForms::get();
  if (segment.size() < 1 + forms.frameWords || wordAt(segment, 0) != forms.root)
    return std::nullopt;
  const auto at = forms.list;
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
  if ((tag & 3) != 0 || dataWords < forms.itemData || stride - dataWords < forms.itemPointers ||
      count * stride > words)
    return std::nullopt;
  PlainFrame frame;
  frame.words_ = segment;
  frame.first_ = static_cast<std::size_t>(tagAt) + 1;
  frame.stride_ = stride;
  frame.itemPointer_ = dataWords + forms.itemPointer - forms.itemData;
  return frame;
}

// A plain item in a frame.
struct PlainFrame::Found {
  const PlainForm* form = nullptr;
  MessageType type{};
  bool isRequest = false;
  const kj::byte* bytes = nullptr;

  template <class Value>
  [[nodiscard]] Value number(std::size_t at) const noexcept {
    return numberAt<Value>(bytes + at);
  }
  [[nodiscard]] bool isFirst() const noexcept {
    return !isRequest && (bytes[form->isFirstBit / 8] >> (form->isFirstBit % 8) & 1) != 0;
  }
  [[nodiscard]] std::uint32_t missed() const noexcept {
    return isRequest ? 0 : number<std::uint32_t>(form->missed);
  }
};

[[gnu::always_inline]] inline bool PlainFrame::tryFind(std::uint32_t index,
                                                       Found& found) const noexcept {
  const auto& forms = PlainForms::get();
  const auto at = first_ + index * stride_;
  const auto which = loadLittle<std::uint16_t>(words_.asBytes(), at * kWordBytes + forms.kindByte);
  found.isRequest = which == forms.request.number;
  const auto& kind = forms.kind(found.isRequest);
  if (which != kind.number) return false;
  const auto pointer = wordAt(words_, at + itemPointer_);
  const auto offset = static_cast<std::int32_t>(static_cast<std::uint32_t>(pointer)) >> 2;
  const auto target = static_cast<std::int64_t>(at + itemPointer_) + 1 + offset;
  if ((pointer & 3) != 0 || pointer >> 32 != kind.shape || target < 0) return false;
  const auto first = static_cast<std::size_t>(target);
  if (first + kind.wordsWithoutMessage > words_.size()) return false;
  found.bytes = words_.asBytes().begin() + first * kWordBytes;
  // The members of the union are in the order of MessageType, from 1 on.
  const auto type = found.number<std::uint16_t>(kind.typeByte) + std::size_t{1};
  if (type >= kind.forms.size()) return false;
  found.form = &kind.forms[type];
  found.type = static_cast<MessageType>(type);
  const auto hasPointer = [&](std::size_t word) {
    return std::memcmp(found.bytes + word * kWordBytes, &found.form->words[word], kWordBytes) == 0;
  };
  return found.form->count != 0 && first + found.form->count <= words_.size() &&
         hasPointer(found.form->toEnvelope) && hasPointer(found.form->toMessage) &&
         (!found.isRequest || found.number<std::uint64_t>(found.form->takeWithin) == 0);
}

bool PlainFrame::tryRead(std::uint32_t index, PlainItem& item) const noexcept {
  Found found;
  if (!tryFind(index, found)) return false;
  const auto& form = *found.form;
  item.isRequest = found.isRequest;
  item.isFirst = found.isFirst();
  item.client = found.number<std::uint32_t>(form.client);
  item.requestId = found.number<std::uint32_t>(form.requestId);
  return withPlainType(found.type, [&]<class T>(std::type_identity<T>) {
    item.message.assignInline(T::kType, sizeof(T),
                              {{0, 0, Message::missedFlags(found.missed()), nullptr},
                               found.number<std::int32_t>(form.clientType),
                               found.number<std::int32_t>(form.clientExtra),
                               found.number<std::int64_t>(form.timeStamp)},
                              [&](auto to) {
                                const auto body = bodyOf<T>(found.bytes, form);
                                std::memcpy(to.data(), &body, sizeof body);
                              });
    return true;
  });
}

PlainItems PlainFrame::readItems(std::uint32_t index, std::uint32_t end,
                                 MessageRun& run) const noexcept {
  PlainItems items{false, false, 0, run};
  run.begin(MessageType::none);
  std::uint32_t first = 0;
  std::uint32_t last = 0;
  for (Found found; index != end && !run.isFull(); ++index) {
    if (!tryFind(index, found) || !MessageRun::canHold(found.type) || found.missed() != 0) break;
    const auto& form = *found.form;
    const auto client = found.number<std::uint32_t>(form.client);
    const auto id = found.number<std::uint32_t>(form.requestId);
    if (run.size() == 0) {
      run.begin(found.type);
      items.isRequest = found.isRequest;
      items.isFirst = found.isFirst();
      items.client = client;
      first = id;
    } else if (found.type != run.type() || found.isRequest != items.isRequest ||
               found.isFirst() != items.isFirst || client != items.client ||
               (id - first <= last - first && (items.isRequest || items.isFirst))) {
      break;
    }
    if (id == 0) break;
    last = id;
    run.add(EnvelopeWords::of({.type = static_cast<std::uint16_t>(found.type),
                               .requestId = id,
                               .clientType = found.number<std::int32_t>(form.clientType),
                               .clientExtra = found.number<std::int32_t>(form.clientExtra),
                               .timeNs = found.number<std::int64_t>(form.timeStamp)},
                              1, layout::kFirstSlotBodyBytes));
    withPlainType(found.type, [&]<class T>(std::type_identity<T>) {
      if constexpr (MessageRun::canHold(T::kType))
        run.add(std::bit_cast<FirstBody>(bodyOf<T>(found.bytes, form)));
      return true;
    });
  }
  return items;
}

// ---- PlainRun

struct PlainRun::Numbers {
  std::uint32_t client, requestId;
  bool isFirst;
  std::uint32_t missed;
  std::int32_t clientType, clientExtra;
  std::int64_t timeStampNs;
};

PlainRun::PlainRun() : payload_(kMaxWords + PlainForm::kMostWords) {}

void PlainRun::clear() noexcept {
  payloadWords_ = 0;
  head_.clear();
  items_.clear();
}

void PlainRun::append(const PlainOutgoing& item) {
  const auto& message = item.message;
  append(item.isRequest, message.getType(),
         {item.client, item.requestId, item.isFirst, message.getMissed(), message.getClientType(),
          message.getClientExtra(), message.getTimeStampNs()},
         message.body().data());
}

void PlainRun::append(const PlainItems& items, std::size_t index) {
  const auto& words = items.run[index];
  append(items.isRequest, items.run.type(),
         {items.client, words.requestId(), items.isFirst, 0, words.clientType(),
          words.clientExtra(), static_cast<std::int64_t>(words.timeNs)},
         items.run.values(index, 1).data());
}

[[gnu::always_inline]] inline void PlainRun::append(bool isRequest, MessageType type,
                                                    const Numbers& numbers, const std::byte* body) {
  const auto& form = PlainForms::get().kind(isRequest).forms[static_cast<std::size_t>(type)];
  const auto at = payloadWords_;
  std::memcpy(payload_.data() + at, form.words.data(), sizeof form.words);
  payloadWords_ += form.count;
  auto* const bytes = reinterpret_cast<kj::byte*>(payload_.data() + at);
  putNumber(bytes + form.client, numbers.client);
  putNumber(bytes + form.requestId, numbers.requestId);
  if (!isRequest) {
    if (numbers.isFirst)
      bytes[form.isFirstBit / 8] |= static_cast<kj::byte>(1u << (form.isFirstBit % 8));
    putNumber(bytes + form.missed, numbers.missed);
  }
  putNumber(bytes + form.clientType, numbers.clientType);
  putNumber(bytes + form.clientExtra, numbers.clientExtra);
  putNumber(bytes + form.timeStamp, numbers.timeStampNs);
  withPlainType(type, [&]<class T>(std::type_identity<T>) {
    putBody<T>(bytes, form, body);
    return true;
  });
  items_.push_back({isRequest, numbers.client, numbers.requestId, static_cast<std::uint32_t>(at)});
}

void PlainRun::buildHead() {
  const auto& forms = PlainForms::get();
  const auto itemWords = forms.itemData + forms.itemPointers;
  const auto listWords = items_.size() * itemWords;
  const auto listAt = 1 + forms.frameWords;  // of the tag
  const auto payloadAt = listAt + 1 + listWords;
  constexpr std::size_t kTable = 1;
  head_.assign(kTable + payloadAt, 0);
  head_[0] = toLittle(std::uint64_t{payloadAt + payloadWords_} << 32);  // one segment
  auto* const words = head_.data() + kTable;
  words[0] = toLittle(forms.root);
  words[forms.list] = toLittle(compositeListPointer(listAt - forms.list - 1, listWords));
  words[listAt] = toLittle(
      structPointer(static_cast<std::int64_t>(items_.size()), forms.itemData, forms.itemPointers));
  auto* item = words + listAt + 1;
  for (const auto& sent : items_) {
    const auto& kind = forms.kind(sent.isRequest);
    storeLittle({reinterpret_cast<kj::byte*>(item), itemWords * kWordBytes}, forms.kindByte,
                kind.number);
    auto* const pointer = item + forms.itemPointer;
    const auto target = payloadAt + sent.word;
    const auto offset = static_cast<std::int64_t>(target) - (pointer - words) - 1;
    *pointer = toLittle(structPointer(offset, 0, 0) | kind.shape << 32);
    item += itemWords;
  }
}

}  // namespace mpf::router
