// SPDX-License-Identifier: MIT
// The fields of a message type as attributes of a class of Python: `numberRetrys` of the
// description is the attribute `number_retrys`.
#pragma once

#include <array>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <limits>
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>

#include <mpf/message_types.h>

namespace mpf::python {

namespace nb = nanobind;

inline std::string attributeName(std::string_view field) {
  std::string name;
  for (const char letter : field) {
    if (std::isupper(static_cast<unsigned char>(letter)) != 0) name += '_';
    name += static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
  }
  return name;
}

// Throws OverflowError, which names the field, unless the number fits.
template <class Value>
Value narrow(long long number, const char* field) {
  if (number < std::numeric_limits<Value>::min() || number > std::numeric_limits<Value>::max()) {
    PyErr_Format(PyExc_OverflowError, "%s: %lld is not a %d-bit integer", field, number,
                 static_cast<int>(8 * sizeof(Value)));
    throw nb::python_error();
  }
  return static_cast<Value>(number);
}

// ---- one field

inline long long toAttribute(std::int32_t value) { return value; }
inline double toAttribute(double value) { return value; }
inline std::string toAttribute(char value) {
  return value == '\0' ? std::string() : std::string(1, value);
}

inline void setField(std::int32_t& field, long long value, const char* name) {
  field = narrow<std::int32_t>(value, name);
}
inline void setField(double& field, double value, const char* /*name*/) { field = value; }
inline void setField(char& field, const std::string& value, const char* name) {
  if (value.size() > 1) {
    PyErr_Format(PyExc_ValueError, "%s: '%s' is longer than one letter", name, value.c_str());
    throw nb::python_error();
  }
  field = value.empty() ? '\0' : value.front();
}
template <std::size_t room>
void setBytes(std::array<char, room>& field, std::int32_t& used, std::string_view value,
              const char* name) {
  if (value.size() > room) {
    PyErr_Format(PyExc_ValueError, "%s: %zd bytes are too long: there is room for %d", name,
                 static_cast<Py_ssize_t>(value.size()), static_cast<int>(room));
    throw nb::python_error();
  }
  field = {};
  std::memcpy(field.data(), value.data(), value.size());
  used = static_cast<std::int32_t>(value.size());
}

// What the standard fields are for; the same words for each type.
inline const char* describe(std::string_view name) {
  if (name == "timeout") return "How long the server may wait for its device [s], by convention.";
  if (name == "cmd") return "The command; each server declares its own.";
  if (name == "status") return "Of a reply: 0 by convention when the request succeeded.";
  if (name == "address") return "For example the channel.";
  if (name == "extra") return "Anything else.";
  if (name == "value") return "The value, in a unit that the server defines.";
  if (name == "baud") return "[bit/s] 0 keeps the present setting, as in all fields.";
  if (name == "stopBits") return "1 or 2.";
  if (name == "bitsPerChar") return "5 to 8.";
  if (name == "parity") return "'E' even, 'O' odd, 'N' none.";
  if (name == "flowControl") return "'H' hardware (RTS/CTS), 'N' none.";
  if (name == "numberRetrys") return "How often the server repeats a command that failed.";
  return "";
}

// ---- all fields of a type

// Not an attribute: the length of the attribute `eom`.
inline constexpr std::string_view kUsedBytesOfEom = "eomLen";

// Held: a class of C++ with the member `fields` of type T.
template <class Held, class T, class Class>
void addFields(Class& type) {
  const auto add = [&type](const auto& field) {
    if constexpr (!requires { field.used; }) {
      if (field.name == kUsedBytesOfEom) return;
      const auto member = field.member;
      using Attribute = decltype(toAttribute(std::declval<T>().*member));
      const auto name = attributeName(field.name);
      type.def_prop_rw(
          name.c_str(), [member](const Held& self) { return toAttribute(self.fields.*member); },
          [member, name](Held& self, Attribute value) {
            setField(self.fields.*member, value, name.c_str());
          },
          describe(field.name));
    }
  };
  std::apply([&](const auto&... field) { (add(field), ...); }, T::fields());
}

// "Int32(value=3, cmd=1)": fields that are 0 are omitted.
//   value  the text for the value, or empty
template <class T>
std::string describe(const char* className, const T& fields, const std::string& value) {
  std::string text;
  const auto append = [&text](const std::string& name, const std::string& shown) {
    if (!text.empty()) text += ", ";
    text += name + "=" + shown;
  };
  if (!value.empty()) append("value", value);
  const auto add = [&](const auto& field) {
    if constexpr (!requires { field.used; }) {
      const auto attribute = toAttribute(fields.*field.member);
      if (attribute == decltype(attribute){} || field.name == kValueName) return;
      append(attributeName(field.name), nb::cast<std::string>(nb::repr(nb::cast(attribute))));
    }
  };
  std::apply([&](const auto&... field) { (add(field), ...); }, T::fields());
  return std::string(className) + "(" + text + ")";
}

}  // namespace mpf::python
