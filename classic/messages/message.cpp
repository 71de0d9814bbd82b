// SPDX-License-Identifier: MIT
#include <mpf/classic/message.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <new>
#include <utility>

#include "schema/text.h"

namespace {

// The five fields that have the same names in both forms.
template <class From, class To>
void copyStandardFields(const From& from, To& to) {
  to.timeout = from.timeout;
  to.cmd = from.cmd;
  to.status = from.status;
  to.address = from.address;
  to.extra = from.extra;
}

// Of Int32, Float64 and OutOfBand.
template <class Body, class Old>
void loadValue(const mpf::Message& message, Old& old) {
  const auto& body = *message.tryAs<Body>();
  copyStandardFields(body, old);
  old.value = body.value;
}
template <class Body, class Old>
mpf::Message unloadValue(const Old& old) {
  Body body;
  copyStandardFields(old, body);
  body.value = old.value;
  return mpf::MessageOf<Body>(body);
}

}  // namespace

Message* Message::allocate(messageType type) {
  switch (type) {
    case messageTypeConnect:
      return new ConnectMessage;
    case messageTypeInt32:
      return new Int32Message;
    case messageTypeInt32Array:
      return new Int32ArrayMessage;
    case messageTypeFloat64:
      return new Float64Message;
    case messageTypeFloat64Array:
      return new Float64ArrayMessage;
    case messageTypeChar8Array:
      return new Char8ArrayMessage;
    case messageTypeSerialConfig:
      return new SerialConfigMessage;
    case messageTypeOutOfBand:
      return new OutOfBandMessage;
  }
  return nullptr;
}

void Message::print() const {
  auto& self = const_cast<Message&>(*this);  // has the same contents afterwards
  auto message = self.unload();
  std::puts(mpf::print(message).c_str());
  self.load(std::move(message));
}

void ConnectMessage::load(mpf::Message&& message) {
  status = static_cast<int32>(message.tryAs<mpf::Connect>()->status);
}
mpf::Message ConnectMessage::unload() {
  return mpf::ConnectMessage({.status = static_cast<mpf::ConnectStatus>(status)});
}

void SerialConfigMessage::load(mpf::Message&& message) {
  const auto& body = *message.tryAs<mpf::SerialConfig>();
  baud = body.baud;
  stopBits = body.stopBits;
  bitsPerChar = body.bitsPerChar;
  parity = body.parity;
  flowControl = body.flowControl;
}
mpf::Message SerialConfigMessage::unload() {
  return mpf::SerialConfigMessage({.baud = baud,
                                   .stopBits = stopBits,
                                   .bitsPerChar = bitsPerChar,
                                   .parity = parity,
                                   .flowControl = flowControl});
}

void Int32Message::load(mpf::Message&& message) { loadValue<mpf::Int32>(message, *this); }
mpf::Message Int32Message::unload() { return unloadValue<mpf::Int32>(*this); }

void Float64Message::load(mpf::Message&& message) { loadValue<mpf::Float64>(message, *this); }
mpf::Message Float64Message::unload() { return unloadValue<mpf::Float64>(*this); }

void OutOfBandMessage::load(mpf::Message&& message) { loadValue<mpf::OutOfBand>(message, *this); }
mpf::Message OutOfBandMessage::unload() { return unloadValue<mpf::OutOfBand>(*this); }

void Char8ArrayMessage::loadOthers(const mpf::Char8Array& body) {
  numberRetrys = body.numberRetrys;
  eomLen = body.eomLen;
  static_assert(sizeof eomString == sizeof body.eomString);
  std::memcpy(eomString, body.eomString.data(), sizeof eomString);
}
void Char8ArrayMessage::unloadOthers(mpf::Char8Array& body) const {
  body.numberRetrys = numberRetrys;
  body.eomLen = eomLen;
  std::memcpy(body.eomString.data(), eomString, sizeof eomString);
}

namespace mpf::classic {

template <class Body>
auto ArrayMessage<Body>::allocValue(int n) -> Element* {
  freeValue();
  try {
    const auto elements = static_cast<std::size_t>(std::max(n, 0));
    body_ = MessageOf<Body>::allocValue(elements);
    std::ranges::fill(body_->value(), Element{});
    value = body_->value().data();
    setCount(0);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
  return value;
}

template <class Body>
void ArrayMessage<Body>::freeValue() {
  body_.reset();
  value = nullptr;
}

template <class Body>
int ArrayMessage<Body>::count() const {
  return body_ ? static_cast<int>(body_->arrayLength()) : 0;
}

template <class Body>
int ArrayMessage<Body>::maxCount() const {
  if (!body_) return 0;
  if constexpr (CountedInBytes<Body>) return static_cast<int>(body_->getMaxSize());
  else return static_cast<int>(body_->getMaxLength());
}

template <class Body>
void ArrayMessage<Body>::setCount(int n) {
  if (!body_) return;
  const auto count = static_cast<std::size_t>(std::clamp(n, 0, maxCount()));
  if constexpr (CountedInBytes<Body>) body_->setSize(count);
  else body_->setLength(count);
}

template <class Body>
void ArrayMessage<Body>::load(mpf::Message&& message) {
  body_ = MessageOf<Body>::tryFrom(std::move(message));
  value = body_->value().data();
  copyStandardFields(**body_, *this);
  loadOthers(**body_);
}

template <class Body>
mpf::Message ArrayMessage<Body>::unload() {
  if (!body_) body_ = MessageOf<Body>::allocValue(0);
  copyStandardFields(*this, **body_);
  unloadOthers(**body_);
  mpf::Message message = std::move(*body_);
  freeValue();
  return message;
}

template class ArrayMessage<Int32Array>;
template class ArrayMessage<Float64Array>;
template class ArrayMessage<Char8Array>;

}  // namespace mpf::classic
