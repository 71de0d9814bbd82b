// SPDX-License-Identifier: MIT
#include "schema/text.h"

#include <cmath>
#include <vector>

#include <mpf/message_of.h>

#include "base/number.h"
#include "schema/visit.h"

namespace mpf {

namespace {

constexpr std::string_view kDigits = "0123456789abcdef";
constexpr std::array<std::pair<char, char>, 8> kEscapes{{{'\r', 'r'},
                                                         {'\n', 'n'},
                                                         {'\t', 't'},
                                                         {'\\', '\\'},
                                                         {'"', '"'},
                                                         {'\a', 'a'},
                                                         {'\b', 'b'},
                                                         {'\f', 'f'}}};

// ---- printing

template <class Number>
std::string printed(Number value) {
  if constexpr (std::is_enum_v<Number>) {
    const auto name = toString(value);
    return name == "unknown" ? std::to_string(static_cast<std::int64_t>(value)) : std::string(name);
  } else if constexpr (std::is_same_v<Number, double>) {
    return printNumber(value);
  } else if constexpr (std::is_same_v<Number, char>) {
    return value == '\0' ? "0" : escape({&value, 1});
  } else {
    return std::to_string(value);
  }
}

std::string printedBytes(std::string_view bytes, std::size_t shown) {
  return '"' + escape(bytes.substr(0, shown)) + '"' +
         (shown < bytes.size() ? "... (" + std::to_string(bytes.size()) + ")" : "");
}

template <class Element>
std::string printedElements(std::span<const Element> value, std::size_t shown) {
  std::string text;
  for (const auto& element : value.first(shown)) {
    if constexpr (std::is_same_v<Element, std::byte>) {
      const auto byte = std::to_integer<unsigned>(element);
      text += {kDigits[byte / 16], kDigits[byte % 16]};
    } else {
      if (&element != value.data()) text += ',';
      text += printed(element);
    }
  }
  if (shown < value.size()) text += ",... (" + std::to_string(value.size()) + ")";
  return text;
}

struct Printer {
  std::string& line;
  std::size_t maxElements;

  void operator()(std::string_view name, std::string_view bytes) const {
    add(name, printedBytes(bytes, bytes.size()));
  }
  template <class Value>
  void operator()(std::string_view name, const Value& value) const {
    if constexpr (requires { value.size(); }) {
      const auto shown = std::min(maxElements, value.size());
      if constexpr (std::is_same_v<Value, std::span<const char>>)
        add(name, printedBytes({value.data(), value.size()}, shown));
      else add(name, printedElements(value, shown));
    } else {
      add(name, printed(value));
    }
  }
  void add(std::string_view name, std::string_view value) const {
    line.append(" ").append(name).append("=").append(value);
  }
};

// ---- parsing: each function returns an empty string, or a description of what was expected

using Expected = std::string;

std::string_view unquoted(std::string_view text) {
  const bool quoted = text.size() >= 2 && text.front() == '"' && text.back() == '"';
  return quoted ? text.substr(1, text.size() - 2) : text;
}

template <class Integer>
Expected parseInto(Integer& to, std::string_view text)
  requires std::is_integral_v<Integer>
{
  const bool negative = text.starts_with('-');
  std::string_view digits = text.substr(negative ? 1 : 0);
  const bool hexadecimal = digits.starts_with("0x") || digits.starts_with("0X");
  if (hexadecimal) digits.remove_prefix(2);
  const auto magnitude = tryNumber<std::uint64_t>(digits, hexadecimal ? 16 : 10);
  const auto most = static_cast<std::uint64_t>(std::numeric_limits<Integer>::max());
  const auto allBits =
      static_cast<std::uint64_t>(std::numeric_limits<std::make_unsigned_t<Integer>>::max());
  const auto limit = negative      ? (std::is_signed_v<Integer> ? most + 1 : 0)
                     : hexadecimal ? allBits
                                   : most;
  if (!magnitude || *magnitude > limit) {
    return "an integer from " + std::to_string(std::numeric_limits<Integer>::min()) + " to " +
           std::to_string(std::numeric_limits<Integer>::max());
  }
  to = static_cast<Integer>(negative ? ~*magnitude + 1 : *magnitude);
  return {};
}

Expected parseInto(double& to, std::string_view text) {
  text.remove_prefix(text.starts_with('+') ? 1 : 0);
  const auto number = tryNumber<double>(text);
  to = number.value_or(0);
  return number ? Expected{} : "a number that a double can hold";
}

Expected parseInto(char& to, std::string_view text) {
  if (text == "0") return to = '\0', Expected{};
  const auto bytes = tryUnescape(text);
  if (!bytes || bytes->size() != 1) return "one character, or 0";
  to = bytes->front();
  return {};
}

template <class Enum, std::size_t n>
Expected parseEnum(Enum& to, std::string_view text, const std::array<std::string_view, n>& names) {
  const auto at = std::find(names.begin(), names.end(), text);
  if (at == names.end()) {
    Expected expected = "one of";
    for (const auto name : names) expected.append(" ").append(name);
    return expected;
  }
  to = static_cast<Enum>(at - names.begin());
  return {};
}
Expected parseInto(ConnectStatus& to, std::string_view text) {
  return parseEnum(to, text, kConnectStatusNames);
}
Expected parseInto(Fate& to, std::string_view text) { return parseEnum(to, text, kFateNames); }

Expected parseElements(std::vector<char>& to, std::string_view text) {
  const auto bytes = tryUnescape(unquoted(text));
  if (!bytes) return "a C-escaped string";
  to.assign(bytes->begin(), bytes->end());
  return {};
}

Expected parseElements(std::vector<std::byte>& to, std::string_view text) {
  Expected expected = "an even number of hexadecimal digits";
  if (text.size() % 2 != 0) return expected;
  for (std::size_t i = 0; i < text.size(); i += 2) {
    const auto byte = tryNumber<std::uint8_t>(text.substr(i, 2), 16);
    if (!byte) return expected;
    to.push_back(std::byte{*byte});
  }
  return {};
}

template <class Number>
Expected parseElements(std::vector<Number>& to, std::string_view text) {
  while (!text.empty()) {
    const auto comma = text.find(',');
    if (auto expected = parseInto(to.emplace_back(), text.substr(0, comma)); !expected.empty())
      return expected + ", separated by commas";
    if (comma + 1 == text.size()) return "another element after the last comma";
    text = comma == text.npos ? "" : text.substr(comma + 1);
  }
  return {};
}

template <class Body, class Value>
Expected parseField(Body& body, const Field<Body, Value>& field, std::string_view text) {
  return parseInto(body.*field.member, text);
}
template <class Body, std::size_t room>
Expected parseField(Body& body, const BytesField<Body, room>& field, std::string_view text) {
  const auto bytes = tryUnescape(unquoted(text));
  if (!bytes || bytes->size() > room)
    return "a C-escaped string of at most " + std::to_string(room) + " bytes";
  std::copy(bytes->begin(), bytes->end(), (body.*field.member).begin());
  body.*field.used = static_cast<std::int32_t>(bytes->size());
  return {};
}

struct Marks {
  std::int32_t clientType = 0;
  std::int32_t clientExtra = 0;
};
constexpr std::tuple kMarks{Field{"clientType", &Marks::clientType},
                            Field{"clientExtra", &Marks::clientExtra}};

// Finds the field `name`; nullopt when the type has no such field.
template <class Body, class Fields>
std::optional<Expected> tryParseField(Body& body, const Fields& fields, std::string_view name,
                                      std::string_view text) {
  std::optional<Expected> found;
  std::apply(
      [&](const auto&... field) {
        static_cast<void>(((field.name == name &&
                            (static_cast<void>(found = parseField(body, field, text)), true)) ||
                           ...));
      },
      fields);
  return found;
}

template <class T>
std::string fieldNames() {
  std::string names;
  const auto add = [&](std::string_view name) {
    names.append(names.empty() ? "" : ", ").append(name);
  };
  std::apply([&](const auto&... field) { (add(field.name), ...); }, T::fields());
  if constexpr (ArrayBody<T>) add(kValueName);
  std::apply([&](const auto&... field) { (add(field.name), ...); }, kMarks);
  return names;
}

template <class T>
struct Elements {};
template <ArrayBody T>
struct Elements<T> {
  std::vector<typename T::Element> value;
};

template <class T>
Message built(const T& body, const Elements<T>& elements) {
  if constexpr (ArrayBody<T>) {
    auto message = MessageOf<T>::allocValue(elements.value.size());
    const auto length = message->length;
    *message = body;
    message->length = length;
    std::copy(elements.value.begin(), elements.value.end(), message.value().begin());
    return message;
  } else {
    return MessageOf<T>(body);
  }
}

template <class T>
std::optional<Message> parseAs(std::span<const std::string> words, std::string& error) {
  T body{};
  Elements<T> elements;
  Marks marks;
  const auto fail = [&](std::string why) {
    return error = std::string(T::kName) + ": " + std::move(why), std::nullopt;
  };
  for (const std::string_view word : words) {
    const auto equals = word.find('=');
    if (equals == word.npos) return fail("\"" + std::string(word) + "\" is not field=value");
    const auto name = word.substr(0, equals);
    const auto text = word.substr(equals + 1);
    auto expected = tryParseField(body, T::fields(), name, text);
    if (!expected) expected = tryParseField(marks, kMarks, name, text);
    if constexpr (ArrayBody<T>) {
      if (!expected && name == kValueName) {
        elements.value.clear();
        expected = parseElements(elements.value, text);
      }
    }
    if (!expected)
      return fail("unknown field \"" + std::string(name) + "\"; use one of " + fieldNames<T>());
    if (!expected->empty())
      return fail("field \"" + std::string(name) + "\" is " + *expected + ", not \"" +
                  std::string(text) + "\"");
  }
  auto message = built<T>(body, elements);
  message.setClientType(marks.clientType);
  message.setClientExtra(marks.clientExtra);
  return message;
}

}  // namespace

std::string printNumber(double value) {
  if (std::isnan(value)) return std::signbit(value) ? "-nan" : "nan";
  std::array<char, 32> text{};
  const auto [end, failure] = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), end};
}

std::string escape(std::string_view bytes) {
  std::string text;
  for (const char c : bytes) {
    const auto* const known = std::find_if(kEscapes.begin(), kEscapes.end(),
                                           [c](const auto& pair) { return pair.first == c; });
    const auto byte = static_cast<unsigned char>(c);
    if (known != kEscapes.end()) text += {'\\', known->second};
    else if (byte >= 0x20 && byte < 0x7f) text += c;
    else text += {'\\', 'x', kDigits[byte / 16], kDigits[byte % 16]};
  }
  return text;
}

std::optional<std::string> tryUnescape(std::string_view text) {
  std::string bytes;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '\\') {
      bytes += text[i];
      continue;
    }
    if (++i == text.size()) return std::nullopt;
    const auto* const known = std::find_if(
        kEscapes.begin(), kEscapes.end(), [&](const auto& pair) { return pair.second == text[i]; });
    if (known != kEscapes.end()) {
      bytes += known->first;
    } else if (text[i] == '0') {
      bytes += '\0';
    } else if (text[i] == 'x') {
      auto digits = text.substr(i + 1, 2);
      const auto length = digits.size();
      const auto byte = tryTakeNumber<std::uint8_t>(digits, 16);
      if (!byte) return std::nullopt;
      bytes += static_cast<char>(*byte);
      i += length - digits.size();
    } else {
      return std::nullopt;
    }
  }
  return bytes;
}

std::string print(const Message& message, std::size_t maxElements) {
  std::string line(toString(message.getType()));
  if (line == "unknown") line = "type " + std::to_string(static_cast<unsigned>(message.getType()));
  const Printer printer{line, maxElements};
  if (!visitFields(message, printer) && message)
    line += ": not one of ours, a body of " + std::to_string(message.body().size()) + " bytes";
  if (message.getClientType() != 0) printer("clientType", message.getClientType());
  if (message.getClientExtra() != 0) printer("clientExtra", message.getClientExtra());
  return line;
}

std::optional<MessageType> tryParseType(std::string_view name) noexcept {
  for (std::size_t i = 1; i < detail::kLayouts.size(); ++i) {
    if (detail::kLayouts[i].name == name) return static_cast<MessageType>(i);
  }
  return std::nullopt;
}

std::string typeNames() {
  std::string names;
  for (std::size_t i = 1; i < detail::kLayouts.size(); ++i)
    names.append(i == 1 ? "" : ", ").append(detail::kLayouts[i].name);
  return names;
}

std::optional<Message> tryParse(MessageType type, std::span<const std::string> words,
                                std::string& error) {
  error = "type " + std::to_string(static_cast<unsigned>(type)) + " is unknown";
  std::optional<Message> message;
  withType(type, [&]<class T>(std::type_identity<T>) {
    return (message = parseAs<T>(words, error)).has_value();
  });
  if (message) error.clear();
  return message;
}

}  // namespace mpf
