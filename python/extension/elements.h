// SPDX-License-Identifier: MIT
// The elements of an array message as Python sees them: a buffer, and the attribute `value`.
//
// Threads  the thread that holds the GIL.
// Trust    as PyMessage.
#pragma once

#include <array>
#include <cstdint>
#include <nanobind/nanobind.h>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "python/extension/field_access.h"
#include "python/extension/gil.h"
#include "python/extension/messages.h"

namespace mpf::python {

// What the module uses of numpy.
enum class Numpy : std::uint8_t { fromBuffer, asArray, arrayEqual, int32, float64 };
[[nodiscard]] nb::handle numpy(Numpy what);
template <class T>
constexpr auto kElementType = std::is_same_v<T, Int32Array> ? Numpy::int32 : Numpy::float64;

template <class T>
inline constexpr const char* kFormat = "B";
template <>
inline constexpr const char* kFormat<Int32Array> = "i";
template <>
inline constexpr const char* kFormat<Float64Array> = "d";

// The buffer protocol: the elements of a received or loaned message, in place.
template <class T>
int getBuffer(PyObject* self, Py_buffer* view, int flags) {
  auto& array = *nb::inst_ptr<PyArray<T>>(self);
  view->obj = nullptr;
  if (array.isEmpty || array.values.is_valid()) {
    PyErr_SetString(PyExc_BufferError,
                    array.isEmpty ? "the message was sent" : "use the attribute `value`");
    return -1;
  }
  if ((flags & PyBUF_WRITABLE) != 0 && !array.isLoaned) {
    PyErr_SetString(PyExc_BufferError, "a received message is read-only");
    return -1;
  }
  using Element = typename T::Element;
  static Py_ssize_t stride = sizeof(Element);
  view->buf = const_cast<Element*>(std::as_const(array.handle).template valueAs<T>().data());
  view->obj = Py_NewRef(self);
  view->len = array.length * stride;
  view->itemsize = stride;
  view->readonly = array.isLoaned ? 0 : 1;
  view->ndim = 1;
  view->format = (flags & PyBUF_FORMAT) != 0 ? const_cast<char*>(kFormat<T>) : nullptr;
  view->shape = (flags & PyBUF_ND) != 0 ? &array.length : nullptr;
  view->strides = (flags & PyBUF_STRIDES) == PyBUF_STRIDES ? &stride : nullptr;
  view->suboffsets = nullptr;
  view->internal = nullptr;
  ++array.exports;
  return 0;
}

template <class T>
void releaseBuffer(PyObject* self, Py_buffer* /*view*/) {
  --nb::inst_ptr<PyArray<T>>(self)->exports;
}

template <class T>
inline PyType_Slot kBufferSlots[] = {
    {Py_bf_getbuffer, reinterpret_cast<void*>(getBuffer<T>)},
    {Py_bf_releasebuffer, reinterpret_cast<void*>(releaseBuffer<T>)},
    {0, nullptr}};

// The elements as users see them: a numpy array, bytes or a memoryview.
template <class T>
nb::object valueOf(nb::handle self) {
  auto& array = *nb::inst_ptr<PyArray<T>>(self);
  if (array.isEmpty) throw nb::value_error(kWasSent);
  if constexpr (CountedInElements<T>) {
    return array.values.is_valid() ? array.values
                                   : numpy(Numpy::fromBuffer)(self, numpy(kElementType<T>));
  } else {
    const auto view = array.values.is_valid() ? array.values : nb::borrow(self);
    if constexpr (std::is_same_v<T, Char8Array>) {
      const BufferView bytes(view);
      return nb::bytes(bytes.bytes().data(), bytes.bytes().size());
    } else {
      auto* result = PyMemoryView_FromObject(view.ptr());
      if (result == nullptr) throw nb::python_error();
      return nb::steal(result);
    }
  }
}

// The number of elements.
template <class T>
std::size_t lengthOf(const PyArray<T>& array) {
  if (!array.values.is_valid()) return static_cast<std::size_t>(array.length);
  return BufferView(array.values).bytes().size() / sizeof(typename T::Element);
}

// Raises TypeError unless the elements are real numbers. Numpy would convert others, too: it drops
// imaginary parts, counts the days of dates, reads texts, and makes NaN of None.
//   elements  an array of numpy
template <class T>
void checkNumbers(nb::handle elements) {
  const auto type = elements.attr("dtype");
  const auto kind = nb::cast<std::string>(type.attr("kind"));
  nb::object wrong;  // name of a type
  if (kind == "O") {  // Python objects, such as Fraction
    const auto real = nb::module_::import_("numbers").attr("Real");
    for (const auto& one : nb::iter(elements)) {
      if (nb::isinstance(one, real)) continue;
      wrong = one.type().attr("__name__");
      break;
    }
  } else if (std::string_view("biuf").find(kind) == std::string_view::npos) {
    wrong = type.attr("name");
  }
  if (!wrong.is_valid()) return;
  PyErr_Format(PyExc_TypeError, "%s: the elements must be real numbers, not %U", kClassName<T>,
               wrong.ptr());
  throw nb::python_error();
}

template <class T>
inline constexpr const char* kUnfit = "the elements are not 32-bit integers";
template <>
inline constexpr const char* kUnfit<Float64Array> = "an element is too large for a 64-bit float";

// The elements as a contiguous array of T's type.
template <class T>
nb::object convertedTo(nb::handle elements) try {
  return numpy(Numpy::asArray)(elements, numpy(kElementType<T>), "C");
} catch (const nb::python_error& error) {
  if (!error.matches(PyExc_OverflowError)) throw;
  throw nb::value_error(kUnfit<T>);
}

// Sets the elements of a message that Python creates.
template <class T>
void setValues(PyArray<T>& array, nb::handle value) {
  const CallsPython guard;
  if constexpr (CountedInElements<T>) {
    const nb::object given = numpy(Numpy::asArray)(value);
    const auto dimensions = nb::cast<int>(given.attr("ndim"));
    if (dimensions == 0) raiseWrongType({kClassName<T>, "value"}, "an array", value);
    if (dimensions != 1) throw nb::value_error("the elements must have one dimension");
    checkNumbers<T>(given);
    // Of a list, numpy refuses integers that do not fit; of an array, it would wrap them.
    const nb::handle source = std::is_same_v<T, Int32Array> ? value : nb::handle(given);
    array.values = convertedTo<T>(source);
    if (std::is_same_v<T, Int32Array> && !array.values.is(given) &&
        !nb::cast<bool>(numpy(Numpy::arrayEqual)(array.values, given)))
      throw nb::value_error(kUnfit<T>);
  } else {
    array.values = nb::isinstance<nb::str>(value) ? value.attr("encode")() : nb::borrow(value);
    static_cast<void>(lengthOf(array));  // throws unless it has a contiguous buffer
  }
}

}  // namespace mpf::python
