// SPDX-License-Identifier: MIT
#include "python/extension/messages.h"

#include <nanobind/stl/string.h>
#include <string>
#include <string_view>
#include <tuple>

#include "python/extension/elements.h"
#include "python/extension/errors.h"
#include "python/extension/field_access.h"

namespace mpf::python {
namespace {

using nb::literals::operator""_a;

// ---- classes

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

constexpr const char* kFields = "value, timeout, cmd, status, address, extra";
constexpr const char* kChar8Fields =
    "value, timeout, cmd, status, address, extra, number_retrys, eom";
constexpr const char* kConfigFields = "baud, stop_bits, bits_per_char, parity, flow_control";

// The arguments of Python that all classes with these fields have.
struct StandardFields {
  nb::handle timeout, cmd, status, address, extra;
};

template <class T>
void setStandardFields(T& fields, const StandardFields& given) {
  const auto set = [](std::int32_t& field, nb::handle value, const char* name) {
    setField(field, value, {kClassName<T>, name});
  };
  set(fields.timeout, given.timeout, "timeout");
  set(fields.cmd, given.cmd, "cmd");
  set(fields.status, given.status, "status");
  set(fields.address, given.address, "address");
  set(fields.extra, given.extra, "extra");
}

// Names a field that the class does not have.
void refuseOthers(const nb::kwargs& others, const char* type, const char* fields) {
  if (others.size() == 0) return;
  for (const auto [name, value] : others) {
    PyErr_Format(PyExc_TypeError, "%s has no field \"%U\"; use %s", type, name.ptr(), fields);
    throw nb::python_error();
  }
}

template <ScalarBody T>
using PyClass = nb::class_<PyScalar<T>, PyMessage>;
template <ArrayBody T>
using PyArrayClass = nb::class_<PyArray<T>, PyMessage>;

#define MPF_STANDARD_ARGUMENTS                                                      \
  nb::kw_only(), "timeout"_a.none() = 0, "cmd"_a.none() = 0, "status"_a.none() = 0, \
                 "address"_a.none() = 0, "extra"_a.none() = 0
#define MPF_STANDARD_SIGNATURE \
  "timeout: int = 0, cmd: int = 0, status: int = 0, address: int = 0, extra: int = 0"
constexpr const char* kIntSignature =
    "def __init__(self, value: int = 0, *, " MPF_STANDARD_SIGNATURE ") -> None";

template <class T>
void addScalar(nb::module_& module, const char* doc, const char* initSignature) {
  PyClass<T> type(module, kClassName<T>, doc);
  type.def(
      "__init__",
      [](PyScalar<T>* self, nb::handle value, nb::handle timeout, nb::handle cmd, nb::handle status,
         nb::handle address, nb::handle extra, const nb::kwargs& others) {
        refuseOthers(others, kClassName<T>, kFields);
        new (self) PyScalar<T>;
        setField(self->fields.value, value, {kClassName<T>, "value"});
        setStandardFields(self->fields, {timeout, cmd, status, address, extra});
      },
      "value"_a.none() = 0, MPF_STANDARD_ARGUMENTS, "others"_a, nb::sig(initSignature));
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
void addArray(nb::module_& module, const char* doc, const char* valueSignature) {
  auto type =
      addArrayClass<T>(module, doc, valueSignature,
                       "The elements, one dimension. Those of a received message are in "
                       "shared memory and read-only; they stay valid as long as the array.");
  type.def(
      "__init__",
      [](PyArray<T>* self, nb::handle value, nb::handle timeout, nb::handle cmd, nb::handle status,
         nb::handle address, nb::handle extra, const nb::kwargs& others) {
        refuseOthers(others, kClassName<T>, kFields);
        PyArray<T> array;  // nothing destroys *self after an exception
        setValues(array, value);
        setStandardFields(array.fields, {timeout, cmd, status, address, extra});
        new (self) PyArray<T>(std::move(array));
      },
      "value"_a.none() = nb::make_tuple(), MPF_STANDARD_ARGUMENTS, "others"_a,
      nb::sig("def __init__(self, value: numpy.typing.ArrayLike = (), *, " MPF_STANDARD_SIGNATURE
              ") -> None"));
}

void addChar8Array(nb::module_& module) {
  auto type = addArrayClass<Char8Array>(
      module, "Bytes or text; a str is encoded as UTF-8.", "def value(self) -> bytes",
      "A copy of the bytes; memoryview(message) does not copy those of a received message.");
  type.def(
      "__init__",
      [](PyArray<Char8Array>* self, nb::handle value, nb::handle timeout, nb::handle cmd,
         nb::handle status, nb::handle address, nb::handle extra, nb::handle retries,
         nb::handle eom, const nb::kwargs& others) {
        refuseOthers(others, kClassName<Char8Array>, kChar8Fields);
        PyArray<Char8Array> array;
        setValues(array, value);
        auto& fields = array.fields;
        setStandardFields(fields, {timeout, cmd, status, address, extra});
        setField(fields.numberRetrys, retries, {kClassName<Char8Array>, "number_retrys"});
        setBytes(fields.eomString, fields.eomLen, eom, {kClassName<Char8Array>, "eom"});
        new (self) PyArray<Char8Array>(std::move(array));
      },
      "value"_a.none() = nb::bytes("", 0), MPF_STANDARD_ARGUMENTS, "number_retrys"_a.none() = 0,
      "eom"_a.none() = nb::bytes("", 0), "others"_a,
      nb::sig("def __init__(self, value: str | typing_extensions.Buffer = b'', "
              "*, " MPF_STANDARD_SIGNATURE ", number_retrys: int = 0, eom: bytes = b'') -> None"));
  type.def_prop_rw(
      "eom",
      [](const PyArray<Char8Array>& self) {
        const auto eom = self.fields.eom();
        return nb::bytes(eom.data(), eom.size());
      },
      [](PyArray<Char8Array>& self, nb::handle eom) {
        setBytes(self.fields.eomString, self.fields.eomLen, eom, {kClassName<Char8Array>, "eom"});
      },
      nb::for_setter(nb::arg().none()),
      nb::for_setter(nb::sig("def eom(self, value: bytes, /) -> None")),
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
      [](PyArray<User>* self, nb::handle value, const nb::kwargs& others) {
        refuseOthers(others, kClassName<User>, "value");
        PyArray<User> array;
        setValues(array, value);
        new (self) PyArray<User>(std::move(array));
      },
      "value"_a.none() = nb::bytes("", 0), "others"_a,
      nb::sig("def __init__(self, value: typing_extensions.Buffer = b'') -> None"));
}

void addSerialConfig(nb::module_& module) {
  using Config = PyScalar<SerialConfig>;
  PyClass<SerialConfig> type(module, kClassName<SerialConfig>,
                             "Settings of a serial line. The reply is an Int32.");
  type.def(
      "__init__",
      [](Config* self, nb::handle baud, nb::handle stopBits, nb::handle bitsPerChar,
         nb::handle parity, nb::handle flowControl, const nb::kwargs& others) {
        constexpr auto* kName = kClassName<SerialConfig>;
        refuseOthers(others, kName, kConfigFields);
        new (self) Config;
        setField(self->fields.baud, baud, {kName, "baud"});
        setField(self->fields.stopBits, stopBits, {kName, "stop_bits"});
        setField(self->fields.bitsPerChar, bitsPerChar, {kName, "bits_per_char"});
        setField(self->fields.parity, parity, {kName, "parity"});
        setField(self->fields.flowControl, flowControl, {kName, "flow_control"});
      },
      nb::kw_only(), "baud"_a.none() = 0, "stop_bits"_a.none() = 0, "bits_per_char"_a.none() = 0,
      "parity"_a.none() = "", "flow_control"_a.none() = "", "others"_a,
      nb::sig("def __init__(self, *, baud: int = 0, stop_bits: int = 0, bits_per_char: int = 0, "
              "parity: str = '', flow_control: str = '') -> None"));
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

nb::object loan(const Allocator& allocator, nb::handle type, std::size_t length,
                const SizeLimit& limit) {
  nb::object result;
  forEachType([&]<class T>(std::type_identity<T> /*type*/) {
    if constexpr (ArrayBody<T>) {
      if (!type.is(nb::type<PyArray<T>>())) return;
      const auto bytes = MessageOf<T>::bytesFor(length);
      if (limit.bytes != 0 && bytes > limit.bytes)
        raiseTooLarge(limit.server, "no loan", bytes, limit.bytes);
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
  nb::class_<PyMessage>(module, "Message",
                        "A message of any type. Messages compare by identity, so that a server "
                        "finds the requests that it keeps: compare their fields.")
      .def_rw("time_stamp_ns", &PyMessage::timeStampNs,
              "Of a reply: when its data was taken [ns since 1970, UTC], as the server says; 0: it "
              "does not say. A Server fills in the time at which it replies.");
  addScalar<Int32>(module, "One 32-bit integer.", kIntSignature);
  addArray<Int32Array>(module, "32-bit integers.",
                       "def value(self) -> numpy.typing.NDArray[numpy.int32]");
  addScalar<Float64>(module, "One 64-bit floating-point number.",
                     "def __init__(self, value: float = 0.0, *, " MPF_STANDARD_SIGNATURE
                     ") -> None");
  addArray<Float64Array>(module, "64-bit floating-point numbers.",
                         "def value(self) -> numpy.typing.NDArray[numpy.float64]");
  addChar8Array(module);
  addSerialConfig(module);
  addScalar<OutOfBand>(module, "As Int32, for messages that a server sends unasked.",
                       kIntSignature);
  addUser(module);
}

}  // namespace mpf::python
