// SPDX-License-Identifier: MIT
// The fields of a message type as attributes of a class of Python: `numberRetrys` of the
// description is the attribute `number_retrys`.
#pragma once

#include <array>
#include <cctype>
#include <cstdint>
#include <cstring>
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

// ---- the class and the field that an error names

template <class T>
inline constexpr const char* kClassName = nullptr;
template <>
inline constexpr const char* kClassName<Int32> = "Int32";
template <>
inline constexpr const char* kClassName<Int32Array> = "Int32Array";
template <>
inline constexpr const char* kClassName<Float64> = "Float64";
template <>
inline constexpr const char* kClassName<Float64Array> = "Float64Array";
template <>
inline constexpr const char* kClassName<Char8Array> = "Char8Array";
template <>
inline constexpr const char* kClassName<SerialConfig> = "SerialConfig";
template <>
inline constexpr const char* kClassName<OutOfBand> = "OutOfBand";
template <>
inline constexpr const char* kClassName<User> = "User";

struct Place {
  const char* type;
  const char* field;
};

// "Int32: value must be an int, not float"
[[noreturn]] inline void raiseWrongType(const Place& place, const char* expected,
                                        nb::handle value) {
  PyErr_Format(PyExc_TypeError, "%s: %s must be %s, not %U", place.type, place.field, expected,
               nb::object(value.type().attr("__name__")).ptr());
  throw nb::python_error();
}

// Replaces the TypeError of a conversion, which names neither.
[[noreturn]] inline void raiseNotConverted(const Place& place, const char* expected,
                                           nb::handle value) {
  if (PyErr_ExceptionMatches(PyExc_TypeError) == 0) throw nb::python_error();
  PyErr_Clear();
  raiseWrongType(place, expected, value);
}

// ---- one field

inline long long toAttribute(std::int32_t value) { return value; }
inline double toAttribute(double value) { return value; }
inline std::string toAttribute(char value) {
  return value == '\0' ? std::string() : std::string(1, value);
}

constexpr const char* typeOf(std::int32_t /*field*/) { return "int"; }
constexpr const char* typeOf(double /*field*/) { return "float"; }
constexpr const char* typeOf(char /*field*/) { return "str"; }

// Accepts what Python accepts as an index: bool and the integers of numpy, but no float.
inline void setField(std::int32_t& field, nb::handle value, const Place& place) {
  const auto index =
      PyLong_CheckExact(value.ptr()) ? nb::borrow(value) : nb::steal(PyNumber_Index(value.ptr()));
  if (!index.is_valid()) raiseNotConverted(place, "an int", value);
  int overflow = 0;
  const auto number = PyLong_AsLongLongAndOverflow(index.ptr(), &overflow);
  if (overflow != 0 || number != static_cast<std::int32_t>(number)) {
    PyErr_Format(PyExc_ValueError, "%s: %S is not a 32-bit integer", place.field, index.ptr());
    throw nb::python_error();
  }
  field = static_cast<std::int32_t>(number);
}
inline void setField(double& field, nb::handle value, const Place& place) {
  const auto number = PyFloat_AsDouble(value.ptr());
  if (number == -1.0 && PyErr_Occurred() != nullptr) {
    if (PyErr_ExceptionMatches(PyExc_OverflowError) == 0)
      raiseNotConverted(place, "a float", value);
    PyErr_Format(PyExc_ValueError, "%s: too large for a 64-bit float", place.field);
    throw nb::python_error();
  }
  field = number;
}
inline void setField(char& field, nb::handle value, const Place& place) {
  if (!nb::isinstance<nb::str>(value)) raiseWrongType(place, "a str", value);
  const auto text = nb::cast<std::string>(value);
  if (text.size() > 1) {
    PyErr_Format(PyExc_ValueError, "%s: '%s' is longer than one letter", place.field, text.c_str());
    throw nb::python_error();
  }
  field = text.empty() ? '\0' : text.front();
}
template <std::size_t room>
void setBytes(std::array<char, room>& field, std::int32_t& used, nb::handle value,
              const Place& place) {
  if (!nb::isinstance<nb::bytes>(value)) raiseWrongType(place, "bytes", value);
  const auto bytes = nb::borrow<nb::bytes>(value);
  if (bytes.size() > room) {
    PyErr_Format(PyExc_ValueError, "%s: %zd bytes are too long: there is room for %d", place.field,
                 static_cast<Py_ssize_t>(bytes.size()), static_cast<int>(room));
    throw nb::python_error();
  }
  field = {};
  std::memcpy(field.data(), bytes.c_str(), bytes.size());
  used = static_cast<std::int32_t>(bytes.size());
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
      const auto name = attributeName(field.name);
      const auto setter =
          "def " + name + "(self, value: " + typeOf(decltype(T{}.*member){}) + ", /) -> None";
      type.def_prop_rw(
          name.c_str(), [member](const Held& self) { return toAttribute(self.fields.*member); },
          [member, name](Held& self, nb::handle value) {
            setField(self.fields.*member, value, {kClassName<T>, name.c_str()});
          },
          nb::for_setter(nb::arg().none()), nb::for_setter(nb::sig(setter.c_str())),
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
      if (field.name == kUsedBytesOfEom) return;
      append(attributeName(field.name), nb::cast<std::string>(nb::repr(nb::cast(attribute))));
    }
  };
  std::apply([&](const auto&... field) { (add(field), ...); }, T::fields());
  if constexpr (requires { fields.eom(); }) {
    const auto eom = fields.eom();
    if (!eom.empty())
      append("eom", nb::cast<std::string>(nb::repr(nb::bytes(eom.data(), eom.size()))));
  }
  return std::string(className) + "(" + text + ")";
}

}  // namespace mpf::python
