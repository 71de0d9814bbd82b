// SPDX-License-Identifier: MIT
#include "epics/general/message_value.h"

#include <algorithm>
#include <cstring>
#include <epicsTypes.h>
#include <fmt/format.h>
#include <menuFtype.h>

#include "base/number.h"

namespace mpf {
namespace {

template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};

template <class T>
bool tryRead(const Message& message, std::optional<Reading>& reading) {
  const auto* fields = message.tryAs<T>();
  if (fields == nullptr) return false;
  if constexpr (CountedInBytes<T>) {
    const auto bytes = message.valueAs<T>();
    reading = Reading{fields->status, std::string_view(bytes.data(), bytes.size())};
  } else if constexpr (ArrayBody<T>) {
    reading = Reading{fields->status, message.valueAs<T>()};
  } else if constexpr (std::is_integral_v<decltype(fields->value)>) {
    reading = Reading{fields->status, std::int64_t{fields->value}};
  } else {
    reading = Reading{fields->status, fields->value};
  }
  return true;
}

std::string_view untilZero(std::string_view text) { return text.substr(0, text.find('\0')); }

// Without the blanks and the + in front of a number.
std::string_view withoutSign(std::string_view text) {
  text = untilZero(text);
  text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n+"), text.size()));
  return text;
}

std::optional<double> numberAtStart(std::string_view text) {
  text = withoutSign(text);
  return tryTakeNumber<double>(text);
}

// nullopt also for a number with a fraction or an exponent.
std::optional<std::int64_t> integerAtStart(std::string_view text) {
  text = withoutSign(text);
  const auto number = tryTakeNumber<std::int64_t>(text);
  const bool isWhole = text.empty() || std::string_view(".eE").find(text[0]) == text.npos;
  return isWhole ? number : std::nullopt;
}

// Calls `act` with each element, until it returns false.
template <class Act>
bool forElements(const MessageValue& value, std::size_t most, const Act& act) {
  const auto all = [&](const auto& elements) {
    return std::ranges::all_of(elements.subspan(0, std::min(most, elements.size())), act);
  };
  return std::visit(
      Overloaded{[&](std::string_view text) {
                   return std::ranges::all_of(text.substr(0, most), [&](char byte) {
                     return act(static_cast<unsigned char>(byte));
                   });
                 },
                 [&](std::span<const std::int32_t> elements) { return all(elements); },
                 [&](std::span<const double> elements) { return all(elements); },
                 [&](auto number) { return act(number); }},
      value);
}

std::size_t countOf(const MessageValue& value) {
  return std::visit(
      Overloaded{[](std::int64_t) { return std::size_t{1}; }, [](double) { return std::size_t{1}; },
                 [](const auto& elements) { return elements.size(); }},
      value);
}

template <class T>
void setFields(T& fields, const LinkOptions& options, std::int32_t cmd) {
  fields.timeout = options.timeoutField();
  fields.cmd = cmd;
  fields.address = options.address;
  fields.extra = options.extra;
}

template <class T>
std::optional<Message> scalarMessage(const LinkOptions& options, std::int32_t cmd,
                                     const MessageValue& value) {
  const auto number = convertTo<decltype(T::value)>(value);
  if (!number) return std::nullopt;
  T fields{};
  setFields(fields, options, cmd);
  fields.value = *number;
  return MessageOf<T>(fields);
}

template <class T>
std::optional<Message> arrayMessage(const LinkOptions& options, std::int32_t cmd,
                                    const MessageValue& value) {
  auto message = MessageOf<T>::allocValue(countOf(value));
  setFields(*message, options, cmd);
  auto at = message.value().begin();
  const bool isFit = forElements(value, message.value().size(), [&](auto element) {
    const auto number = fit<typename T::Element>(element);
    if (number) *at++ = *number;
    return number.has_value();
  });
  return isFit ? std::optional<Message>(std::move(message)) : std::nullopt;
}

std::optional<Message> textMessage(const LinkOptions& options, std::int32_t cmd,
                                   const MessageValue& value) {
  const auto* bytes = std::get_if<std::string_view>(&value);
  const auto text = bytes != nullptr ? std::string(*bytes) : toText(value).value_or("");
  auto message = Char8ArrayMessage::allocValue(text.size());
  setFields(*message, options, cmd);
  std::ranges::copy(text, message.value().begin());
  return message;
}

// Calls `act` with a null pointer to the type of the elements.
template <class Act>
auto withElementType(int elementType, const Act& act) {
  switch (elementType) {
    case menuFtypeCHAR:
      return act(static_cast<epicsInt8*>(nullptr));
    case menuFtypeSHORT:
      return act(static_cast<epicsInt16*>(nullptr));
    case menuFtypeUSHORT:
    case menuFtypeENUM:
      return act(static_cast<epicsUInt16*>(nullptr));
    case menuFtypeLONG:
      return act(static_cast<epicsInt32*>(nullptr));
    case menuFtypeULONG:
      return act(static_cast<epicsUInt32*>(nullptr));
    case menuFtypeINT64:
      return act(static_cast<epicsInt64*>(nullptr));
    case menuFtypeUINT64:
      return act(static_cast<epicsUInt64*>(nullptr));
    case menuFtypeFLOAT:
      return act(static_cast<epicsFloat32*>(nullptr));
    case menuFtypeDOUBLE:
      return act(static_cast<epicsFloat64*>(nullptr));
    default:
      return act(static_cast<epicsUInt8*>(nullptr));
  }
}

}  // namespace

std::optional<Reading> readingOf(const Message& message) {
  std::optional<Reading> reading;
  static_cast<void>(tryRead<Int32>(message, reading) || tryRead<Float64>(message, reading) ||
                    tryRead<Int32Array>(message, reading) ||
                    tryRead<Float64Array>(message, reading) ||
                    tryRead<Char8Array>(message, reading));
  return reading;
}

std::optional<Message> makeMessage(const LinkOptions& options, std::int32_t cmd,
                                   const MessageValue& value) {
  switch (options.type) {
    case MessageType::int32:
      return scalarMessage<Int32>(options, cmd, value);
    case MessageType::float64:
      return scalarMessage<Float64>(options, cmd, value);
    case MessageType::int32Array:
      return arrayMessage<Int32Array>(options, cmd, value);
    case MessageType::float64Array:
      return arrayMessage<Float64Array>(options, cmd, value);
    default:
      return textMessage(options, cmd, value);
  }
}

std::optional<Message> makeQuery(const LinkOptions& options, std::int32_t cmd) {
  const bool isScalar = options.type == MessageType::int32 || options.type == MessageType::float64;
  return makeMessage(options, cmd,
                     isScalar ? MessageValue(options.value) : MessageValue(std::string_view()));
}

std::optional<double> toDouble(const MessageValue& value) {
  if (const auto* text = std::get_if<std::string_view>(&value)) return numberAtStart(*text);
  std::optional<double> number;
  forElements(value, 1, [&](auto element) {
    number = fit<double>(element);
    return false;
  });
  return number;
}

std::optional<std::int64_t> toInteger(const MessageValue& value) {
  if (const auto* number = std::get_if<std::int64_t>(&value)) return *number;
  const auto* text = std::get_if<std::string_view>(&value);
  if (const auto integer = text != nullptr ? integerAtStart(*text) : std::nullopt) return integer;
  const auto number = toDouble(value);
  return number ? fit<std::int64_t>(*number) : std::nullopt;
}

std::optional<std::uint32_t> toBits(const MessageValue& value) {
  const auto number = toInteger(value);
  if (!number || *number < INT32_MIN || *number > std::int64_t{UINT32_MAX}) return std::nullopt;
  return static_cast<std::uint32_t>(*number);
}

std::optional<std::string> toText(const MessageValue& value) {
  if (const auto* text = std::get_if<std::string_view>(&value))
    return std::string(untilZero(*text));
  std::optional<std::string> text;
  forElements(value, 1, [&](auto element) {
    text = fmt::format("{}", element);
    return false;
  });
  return text;
}

Stored storeElements(const MessageValue& value, int elementType, void* array, std::uint32_t room,
                     std::uint32_t& used) {
  const auto count = std::min<std::size_t>(countOf(value), room);
  return withElementType(elementType, [&]<class T>(T*) {
    std::vector<T> elements;
    elements.reserve(count);
    const bool isFit = forElements(value, count, [&](auto element) {
      // A byte of text keeps its bits in an array of CHAR.
      if constexpr (sizeof(element) == 1 && sizeof(T) == 1) {
        elements.push_back(static_cast<T>(element));
        return true;
      } else {
        const auto number = fit<T>(element);
        if (number) elements.push_back(*number);
        return number.has_value();
      }
    });
    if (!isFit) return Stored::doesNotFit;
    std::memcpy(array, elements.data(), elements.size() * sizeof(T));
    used = static_cast<std::uint32_t>(elements.size());
    return countOf(value) > room ? Stored::truncated : Stored::done;
  });
}

std::optional<MessageValue> loadElements(int elementType, const void* array, std::uint32_t used,
                                         std::vector<double>& scratch) {
  return withElementType(elementType, [&]<class T>(T*) -> std::optional<MessageValue> {
    const auto* elements = static_cast<const T*>(array);
    if constexpr (sizeof(T) == 1) {
      return std::string_view(static_cast<const char*>(array), used);
    } else if constexpr (std::is_same_v<T, epicsInt32> || std::is_same_v<T, double>) {
      return std::span<const T>(elements, used);
    } else {
      scratch.clear();
      scratch.reserve(used);
      for (const T element : std::span(elements, used)) {
        const auto number = fit<double>(element);
        if (!number) return std::nullopt;
        scratch.push_back(*number);
      }
      return std::span<const double>(scratch);
    }
  });
}

MessageType messageTypeOf(int elementType) noexcept {
  switch (elementType) {
    case menuFtypeSTRING:
      return MessageType::none;
    case menuFtypeCHAR:
    case menuFtypeUCHAR:
      return MessageType::char8Array;
    case menuFtypeSHORT:
    case menuFtypeUSHORT:
    case menuFtypeENUM:
    case menuFtypeLONG:
      return MessageType::int32Array;
    default:
      return MessageType::float64Array;
  }
}

}  // namespace mpf
