// SPDX-License-Identifier: MIT
// The extension module mpf._mpf. Programs import mpf, whose classes are made of those of this
// module.
#include <nanobind/nanobind.h>

#include "python/extension/client.h"
#include "python/extension/errors.h"
#include "python/extension/gil.h"
#include "python/extension/messages.h"
#include "python/extension/options.h"
#include "python/extension/server.h"

namespace {

// Threads of MPF and fork handlers exist once for each process, not for each interpreter.
void refuseSubinterpreter() {
  constexpr std::int64_t kMainInterpreter = 0;
  if (PyInterpreterState_GetID(PyInterpreterState_Get()) == kMainInterpreter) return;
  PyErr_SetString(PyExc_ImportError,
                  "mpf cannot be used in a sub-interpreter: import it in the main interpreter");
  throw nanobind::python_error();
}

}  // namespace

NB_MODULE(_mpf, module) {
  refuseSubinterpreter();
  nanobind::set_leak_warnings(false);  // a program may end while its threads use objects
  module.doc() = "The parts of mpf that are written in C++.";
  module.attr("version") = MPF_PYTHON_VERSION;
  mpf::python::countForks();
  mpf::python::forgetThreadsInForks();
  nanobind::module_::import_("atexit").attr("register")(
      nanobind::cpp_function(&mpf::python::prepareExit));
  mpf::python::addErrors();
  mpf::python::addMessages(module);
  mpf::python::addClient(module);
  mpf::python::addServer(module);
}
