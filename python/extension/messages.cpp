// SPDX-License-Identifier: MIT
#include "python/extension/messages.h"

#include <array>
#include <nanobind/stl/string.h>
#include <string>
#include <string_view>
#include <tuple>

#include "python/extension/field_access.h"

namespace mpf::python {
namespace {

using nb::literals::operator""_a;

// ---- elements

template <class T>
constexpr const char* kFormat = "B";
template <>
constexpr const char* kFormat<Int32Array> = "i";
template <>
constexpr const char* kFormat<Float64Array> = "d";

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
PyType_Slot kBufferSlots[] = {{Py_bf_getbuffer, reinterpret_cast<void*>(getBuffer<T>)},
                              {Py_bf_releasebuffer, reinterpret_cast<void*>(releaseBuffer<T>)},
                              {0, nullptr}};

// What the module uses of numpy.
enum class Numpy : std::uint8_t { fromBuffer, asContiguousArray, arrayEqual, int32, float64 };
constexpr std::array kNumpyNames{"frombuffer", "ascontiguousarray", "array_equal", "int32",
                                 "float64"};
template <class T>
constexpr auto kElementType = std::is_same_v<T, Int32Array> ? Numpy::int32 : Numpy::float64;

// Looked up at the first use. Not a static initialiser: a thread that waits for it would hold the
// GIL, which the import needs.
nb::handle of(Numpy what) {
  static std::array<PyObject*, kNumpyNames.size()> found{};
  const auto index = static_cast<std::size_t>(what);
  if (found[index] == nullptr)
    found[index] =
        nb::object(nb::module_::import_("numpy").attr(kNumpyNames[index])).release().ptr();
  return found[index];
}

// The elements as users see them: a numpy array, bytes or a memoryview.
template <class T>
nb::object valueOf(nb::handle self) {
  auto& array = *nb::inst_ptr<PyArray<T>>(self);
  if (array.isEmpty) throw nb::value_error(kWasSent);
  if constexpr (CountedInElements<T>) {
    return array.values.is_valid() ? array.values
                                   : of(Numpy::fromBuffer)(self, of(kElementType<T>));
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

// Sets the elements of a message that Python creates.
template <class T>
void setValues(PyArray<T>& array, nb::handle value) {
  const CallsPython guard;
  if constexpr (CountedInElements<T>) {
    array.values = of(Numpy::asContiguousArray)(value, of(kElementType<T>));
    if (std::is_same_v<T, Int32Array> && !array.values.is(value) &&
        !nb::cast<bool>(of(Numpy::arrayEqual)(array.values, value)))
      throw nb::value_error("the elements are not 32-bit integers");
    if (nb::cast<int>(array.values.attr("ndim")) != 1)
      throw nb::value_error("the elements must have one dimension");
  } else {
    array.values = nb::isinstance<nb::str>(value) ? value.attr("encode")() : nb::borrow(value);
    static_cast<void>(lengthOf(array));  // throws unless it has a contiguous buffer
  }
}

// ---- classes

template <class T>
constexpr const char* kClassName = nullptr;
template <>
constexpr const char* kClassName<Int32> = "Int32";
template <>
constexpr const char* kClassName<Int32Array> = "Int32Array";
template <>
constexpr const char* kClassName<Float64> = "Float64";
template <>
constexpr const char* kClassName<Float64Array> = "Float64Array";
template <>
constexpr const char* kClassName<Char8Array> = "Char8Array";
template <>
constexpr const char* kClassName<SerialConfig> = "SerialConfig";
template <>
constexpr const char* kClassName<OutOfBand> = "OutOfBand";
template <>
constexpr const char* kClassName<User> = "User";

// Calls `act` with std::type_identity<T>, for each type that has a class.
template <class Act>
void forEachType(Act&& act) {
  std::apply(
      [&](auto... type) {
        const auto visit = [&]<class T>(std::type_identity<T> identity) {
          if constexpr (kClassName<T> != nullptr) act(identity);
        };
        (visit(std::type_identity<decltype(type)>{}), ...);
      },
      MessageTypes{});
}

template <class T>
void setStandardFields(T& fields, long long timeout, long long cmd, long long status,
                       long long address, long long extra) {
  fields.timeout = narrow<std::int32_t>(timeout, "timeout");
  fields.cmd = narrow<std::int32_t>(cmd, "cmd");
  fields.status = narrow<std::int32_t>(status, "status");
  fields.address = narrow<std::int32_t>(address, "address");
  fields.extra = narrow<std::int32_t>(extra, "extra");
}

template <ScalarBody T>
using PyClass = nb::class_<PyScalar<T>, PyMessage>;
template <ArrayBody T>
using PyArrayClass = nb::class_<PyArray<T>, PyMessage>;

#define MPF_STANDARD_ARGUMENTS \
  nb::kw_only(), "timeout"_a = 0, "cmd"_a = 0, "status"_a = 0, "address"_a = 0, "extra"_a = 0

template <class T>
void addScalar(nb::module_& module, const char* doc) {
  PyClass<T> type(module, kClassName<T>, doc);
  using Value = decltype(toAttribute(T{}.value));
  type.def(
      "__init__",
      [](PyScalar<T>* self, Value value, long long timeout, long long cmd, long long status,
         long long address, long long extra) {
        new (self) PyScalar<T>;
        setField(self->fields.value, value, "value");
        setStandardFields(self->fields, timeout, cmd, status, address, extra);
      },
      "value"_a = 0, MPF_STANDARD_ARGUMENTS);
  addFields<PyScalar<T>, T>(type);
  type.def("__repr__", [](const PyScalar<T>& self) {
    const auto value = nb::repr(nb::cast(toAttribute(self.fields.value)));
    return describe(kClassName<T>, self.fields, nb::cast<std::string>(value));
  });
}

template <class T>
PyArrayClass<T> addArrayClass(nb::module_& module, const char* doc, const char* valueSignature,
                              const char* valueDoc) {
  PyArrayClass<T> type(module, kClassName<T>, nb::type_slots(kBufferSlots<T>), doc);
  addFields<PyArray<T>, T>(type);
  type.def_prop_ro("value", &valueOf<T>, nb::for_getter(nb::sig(valueSignature)), valueDoc);
  type.def("__len__", &lengthOf<T>);
  type.def("__repr__", [](nb::handle self) {
    const CallsPython guard;
    const auto& array = *nb::inst_ptr<PyArray<T>>(self);
    const auto value = array.isEmpty ? "sent" : nb::cast<std::string>(nb::repr(valueOf<T>(self)));
    return describe(kClassName<T>, array.fields, value);
  });
  return type;
}

template <class T>
void addArray(nb::module_& module, const char* doc, const char* valueSignature,
              const char* initSignature) {
  auto type =
      addArrayClass<T>(module, doc, valueSignature,
                       "The elements, one dimension. Those of a received message are in "
                       "shared memory and read-only; they stay valid as long as the array.");
  type.def(
      "__init__",
      [](PyArray<T>* self, nb::handle value, long long timeout, long long cmd, long long status,
         long long address, long long extra) {
        PyArray<T> array;  // nothing destroys *self after an exception
        setValues(array, value);
        setStandardFields(array.fields, timeout, cmd, status, address, extra);
        new (self) PyArray<T>(std::move(array));
      },
      "value"_a = nb::make_tuple(), MPF_STANDARD_ARGUMENTS, nb::sig(initSignature));
}

void addChar8Array(nb::module_& module) {
  auto type = addArrayClass<Char8Array>(
      module, "Bytes or text; a str is encoded as UTF-8.", "def value(self) -> bytes",
      "A copy of the bytes; memoryview(message) does not copy those of a received message.");
  type.def(
      "__init__",
      [](PyArray<Char8Array>* self, nb::handle value, long long timeout, long long cmd,
         long long status, long long address, long long extra, long long retries,
         const nb::bytes& eom) {
        PyArray<Char8Array> array;
        setValues(array, value);
        auto& fields = array.fields;
        setStandardFields(fields, timeout, cmd, status, address, extra);
        fields.numberRetrys = narrow<std::int32_t>(retries, "number_retrys");
        setBytes(fields.eomString, fields.eomLen, {eom.c_str(), eom.size()}, "eom");
        new (self) PyArray<Char8Array>(std::move(array));
      },
      "value"_a = nb::bytes("", 0), MPF_STANDARD_ARGUMENTS, "number_retrys"_a = 0,
      "eom"_a = nb::bytes("", 0),
      nb::sig("def __init__(self, value: str | typing_extensions.Buffer = b'', *, timeout: int = "
              "0, cmd: int = 0, status: int = 0, address: int = 0, extra: int = 0, "
              "number_retrys: int = 0, eom: bytes = b'') -> None"));
  type.def_prop_rw(
      "eom",
      [](const PyArray<Char8Array>& self) {
        const auto eom = self.fields.eom();
        return nb::bytes(eom.data(), eom.size());
      },
      [](PyArray<Char8Array>& self, const nb::bytes& eom) {
        setBytes(self.fields.eomString, self.fields.eomLen, {eom.c_str(), eom.size()}, "eom");
      },
      "The end-of-message string, at most 4 bytes.");
  type.def_prop_ro(
      "text",
      [](nb::handle self) {
        return nb::str(valueOf<Char8Array>(self).attr("decode")("utf-8", "replace"));
      },
      "The bytes as text: UTF-8, invalid bytes replaced.");
}

void addUser(nb::module_& module) {
  auto type = addArrayClass<User>(
      module, "Any bytes, which MPF does not interpret; C++ programs send Cap'n Proto structs.",
      "def value(self) -> memoryview",
      "The bytes; those of a received message are in shared memory and read-only.");
  type.def(
      "__init__",
      [](PyArray<User>* self, nb::handle value) {
        PyArray<User> array;
        setValues(array, value);
        new (self) PyArray<User>(std::move(array));
      },
      "value"_a = nb::bytes("", 0),
      nb::sig("def __init__(self, value: typing_extensions.Buffer = b'') -> None"));
}

void addSerialConfig(nb::module_& module) {
  using Config = PyScalar<SerialConfig>;
  PyClass<SerialConfig> type(module, kClassName<SerialConfig>,
                             "Settings of a serial line. The reply is an Int32.");
  type.def(
      "__init__",
      [](Config* self, long long baud, long long stopBits, long long bitsPerChar,
         const std::string& parity, const std::string& flowControl) {
        new (self) Config;
        setField(self->fields.baud, baud, "baud");
        setField(self->fields.stopBits, stopBits, "stop_bits");
        setField(self->fields.bitsPerChar, bitsPerChar, "bits_per_char");
        setField(self->fields.parity, parity, "parity");
        setField(self->fields.flowControl, flowControl, "flow_control");
      },
      nb::kw_only(), "baud"_a = 0, "stop_bits"_a = 0, "bits_per_char"_a = 0, "parity"_a = "",
      "flow_control"_a = "");
  addFields<Config, SerialConfig>(type);
  type.def("__repr__",
           [](const Config& self) { return describe(kClassName<SerialConfig>, self.fields, ""); });
}

// ---- messages that arrive

template <class T>
nb::object make(Message&& message, bool isRequest) {
  if constexpr (ArrayBody<T>) {
    PyArray<T> array;
    array.fields = *std::as_const(message).tryAs<T>();
    array.length = message.arrayLength();
    array.timeStampNs = message.getTimeStampNs();
    array.handle = std::move(message);
    return nb::cast(std::move(array));
  } else {
    PyScalar<T> scalar;
    scalar.fields = *std::as_const(message).tryAs<T>();
    scalar.timeStampNs = message.getTimeStampNs();
    if (isRequest) scalar.handle = std::move(message);
    return nb::cast(std::move(scalar));
  }
}

// Returns an empty object, and leaves `message` as it is, if it has no class or is not sound.
nb::object tryConvert(Message&& message, bool isRequest) {
  nb::object result;
  const auto type = message.getType();
  if (!message.isSound()) return result;
  forEachType([&]<class T>(std::type_identity<T> /*type*/) {
    if (type == T::kType) result = make<T>(std::move(message), isRequest);
  });
  return result;
}

}  // namespace

nb::object toPython(Message&& message) {
  const auto type = static_cast<int>(message.getType());
  auto result = tryConvert(std::move(message), false);
  if (result.is_valid()) return result;
  PyErr_Format(PyExc_TypeError, "a message of type %d arrived, which this version of mpf lacks",
               type);
  throw nb::python_error();
}
nb::object tryRequestToPython(Message&& request) { return tryConvert(std::move(request), true); }

nb::object loan(const Allocator& allocator, nb::handle type, std::size_t length) {
  nb::object result;
  forEachType([&]<class T>(std::type_identity<T> /*type*/) {
    if constexpr (ArrayBody<T>) {
      if (!type.is(nb::type<PyArray<T>>())) return;
      PyArray<T> array;
      array.handle = allocator.array<T>(length);
      array.length = static_cast<Py_ssize_t>(length);
      array.isLoaned = true;
      result = nb::cast(std::move(array));
    }
  });
  if (!result.is_valid())
    throw nb::type_error("loan: the type must be Int32Array, Float64Array, Char8Array or User");
  return result;
}

void addMessages(nb::module_& module) {
  nb::class_<PyMessage>(module, "Message", "A message of any type.")
      .def_rw("time_stamp_ns", &PyMessage::timeStampNs,
              "Of a reply: when its data was taken [ns since 1970, UTC], as the server says; 0: it "
              "does not say. A Server fills in the time at which it replies.");
  addScalar<Int32>(module, "One 32-bit integer.");
  addArray<Int32Array>(module, "32-bit integers.",
                       "def value(self) -> numpy.typing.NDArray[numpy.int32]",
                       "def __init__(self, value: numpy.typing.ArrayLike = (), *, timeout: int = "
                       "0, cmd: int = 0, status: int = 0, address: int = 0, extra: int = 0) -> "
                       "None");
  addScalar<Float64>(module, "One 64-bit floating-point number.");
  addArray<Float64Array>(module, "64-bit floating-point numbers.",
                         "def value(self) -> numpy.typing.NDArray[numpy.float64]",
                         "def __init__(self, value: numpy.typing.ArrayLike = (), *, timeout: int "
                         "= 0, cmd: int = 0, status: int = 0, address: int = 0, extra: int = 0) "
                         "-> None");
  addChar8Array(module);
  addSerialConfig(module);
  addScalar<OutOfBand>(module, "As Int32, for messages that a server sends unasked.");
  addUser(module);
}

}  // namespace mpf::python
