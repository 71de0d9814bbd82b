// SPDX-License-Identifier: MIT
// The class behind mpf.Server.
//
// Threads  one thread receives; any thread may reply, refuse and interrupt.
// Fork     a server of the parent raises an exception in the child.
#pragma once

#include <nanobind/nanobind.h>

namespace mpf::python {

void addServer(nanobind::module_& module);

}  // namespace mpf::python
