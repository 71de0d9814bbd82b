// SPDX-License-Identifier: MIT
#include "epics/devices/string_parm/value_format.h"

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <fmt/format.h>
#include <stdexcept>
#include <type_traits>
#include <utility>

namespace mpf {
namespace {

constexpr int kMaxDigits = 3;  // of a width or precision

constexpr bool isOneOf(char c, std::string_view set) {
  return set.find(c) != std::string_view::npos;
}
constexpr bool isUnsigned(char conversion) { return isOneOf(conversion, "ouxX"); }

// Reads a format from left to right.
class FormatReader {
 public:
  explicit FormatReader(std::string_view format) : format_(format) {}
  [[nodiscard]] bool isAtEnd() const { return at_ == format_.size(); }
  char next() {
    if (isAtEnd()) refuse("a conversion is incomplete");
    return format_[at_++];
  }
  bool tryRead(char c) {
    if (isAtEnd() || format_[at_] != c) return false;
    ++at_;
    return true;
  }
  std::string readAll(std::string_view set) {
    const auto begin = at_;
    while (!isAtEnd() && isOneOf(format_[at_], set)) ++at_;
    return std::string(format_.substr(begin, at_ - begin));
  }
  std::string readNumber() {
    auto digits = readAll("0123456789");
    if (digits.size() > kMaxDigits) refuse("a width or precision has more than three digits");
    return digits;
  }
  // The rest of %[...], after its bracket.
  std::string readSet() {
    std::string set;
    if (tryRead('^')) set += '^';
    do set += next();
    while (set.back() != ']' || set == "]" || set == "^]");
    return set;
  }
  [[noreturn]] void refuse(std::string_view reason) const {
    throw std::invalid_argument(fmt::format("format \"{}\": {}", format_, reason));
  }

 private:
  std::string_view format_;
  std::size_t at_ = 0;
};

struct Conversion {
  std::string text;  // without % and conversion character
  char character = 0;
  bool isSkipped = false;  // %*
};

// The conversion after a '%', in a format that is passed `lengthModifier`.
Conversion readConversion(FormatReader& reader, FormatUse use, std::string_view conversions,
                          std::string_view lengthModifier) {
  Conversion result;
  if (use == FormatUse::print) {
    result.text = reader.readAll("-+ #0");
    result.text += reader.readNumber();
    if (reader.tryRead('.')) result.text += "." + reader.readNumber();
  } else {
    result.isSkipped = reader.tryRead('*');
    if (result.isSkipped) result.text = "*";
    const auto width = reader.readNumber();
    if (!width.empty() && width.find_first_not_of('0') == std::string::npos)
      reader.refuse("a width is 0");
    result.text += width;
  }
  const bool isLong = reader.tryRead('l');
  result.character = reader.next();
  if (isOneOf(result.character, conversions)) {
    if (result.character != 'c' && !result.isSkipped) result.text += lengthModifier;
    else if (isLong && result.character == 'c') reader.refuse("%lc is not supported");
    return result;
  }
  if (!result.isSkipped || isLong || !isOneOf(result.character, "diouxXaAeEfFgGsc["))
    reader.refuse(fmt::format("a conversion '{}' does not fit the value; use one of {}",
                              result.character, conversions));
  return result;
}

template <class Value>
constexpr std::string_view conversionsOf(FormatUse use) {
  if constexpr (std::is_same_v<Value, double>) return "fFeEgGaA";
  return use == FormatUse::print ? "diouxXc" : "diouxX";
}

// The modifiers of long long; of double, which printf() wants without.
template <class Value>
constexpr std::string_view lengthModifierOf(FormatUse use) {
  if constexpr (std::is_same_v<Value, double>) return use == FormatUse::print ? "" : "l";
  return "ll";
}

// The format of a user, checked and rewritten by ValueFormat.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
#pragma GCC diagnostic ignored "-Wformat-security"
// NOLINTBEGIN(cppcoreguidelines-pro-type-vararg,hicpp-vararg,cert-err34-c)
template <class Argument>
std::string printed(const std::string& format, Argument argument) {
  const auto size = std::snprintf(nullptr, 0, format.c_str(), argument);
  if (size <= 0) return {};
  std::string text(static_cast<std::size_t>(size), '\0');
  std::snprintf(text.data(), text.size() + 1, format.c_str(), argument);
  return text;
}

// nullopt also for a number that the argument cannot hold; one that is almost 0 is 0.
template <class Argument>
std::optional<Argument> scanned(const std::string& format, const std::string& text) {
  Argument argument{};
  errno = 0;
  if (std::sscanf(text.c_str(), format.c_str(), &argument) != 1) return std::nullopt;
  if (errno == ERANGE && !(std::abs(static_cast<double>(argument)) < 1)) return std::nullopt;
  return argument;
}
// NOLINTEND(cppcoreguidelines-pro-type-vararg,hicpp-vararg,cert-err34-c)
#pragma GCC diagnostic pop

}  // namespace

template <class Value>
ValueFormat<Value>::ValueFormat(std::string_view format, FormatUse use) {
  FormatReader reader(format);
  while (!reader.isAtEnd()) {
    format_ += reader.next();
    if (format_.back() != '%') continue;
    if (reader.tryRead('%')) {
      format_ += '%';
      continue;
    }
    const auto conversion =
        readConversion(reader, use, conversionsOf<Value>(use), lengthModifierOf<Value>(use));
    format_ += conversion.text + conversion.character;
    if (conversion.character == '[') format_ += reader.readSet();
    if (conversion.isSkipped) continue;
    if (conversion_ != 0) reader.refuse("more than one conversion");
    conversion_ = conversion.character;
  }
}

template <class Value>
std::string ValueFormat<Value>::print(Value value) const {
  if constexpr (std::is_same_v<Value, double>) {
    return printed(format_, value);
  } else {
    if (conversion_ == 'c') return printed(format_, static_cast<int>(value));
    if (isUnsigned(conversion_))
      return printed(format_, static_cast<unsigned long long>(static_cast<std::uint32_t>(value)));
    return printed(format_, static_cast<long long>(value));
  }
}

template <class Value>
std::optional<Value> ValueFormat<Value>::scan(const std::string& text) const {
  if (conversion_ == 0) return std::nullopt;
  if constexpr (std::is_same_v<Value, double>) {
    return scanned<double>(format_, text);
  } else if (isUnsigned(conversion_)) {
    const auto value = scanned<unsigned long long>(format_, text);
    // A negative number is scanned as the unsigned number with the same bits.
    if (!value || !(std::in_range<std::uint32_t>(*value) ||
                    std::in_range<Value>(static_cast<long long>(*value))))
      return std::nullopt;
    return static_cast<Value>(*value);
  } else {
    const auto value = scanned<long long>(format_, text);
    return value && std::in_range<Value>(*value) ? std::optional(static_cast<Value>(*value))
                                                 : std::nullopt;
  }
}

template class ValueFormat<double>;
template class ValueFormat<std::int32_t>;

}  // namespace mpf
