// SPDX-License-Identifier: MIT
#include "python/extension/elements.h"

namespace mpf::python {
namespace {

constexpr std::array kNumpyNames{"frombuffer", "asarray", "array_equal", "int32", "float64"};

}  // namespace

// Looked up at the first use. Not a static initialiser: a thread that waits for it would hold the
// GIL, which the import needs.
nb::handle numpy(Numpy what) {
  static std::array<PyObject*, kNumpyNames.size()> found{};
  const auto index = static_cast<std::size_t>(what);
  if (found[index] == nullptr)
    found[index] =
        nb::object(nb::module_::import_("numpy").attr(kNumpyNames[index])).release().ptr();
  return found[index];
}

}  // namespace mpf::python
