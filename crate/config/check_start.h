// SPDX-License-Identifier: MIT
// checkStart(): what a start of the processes of a crate would fail with, found without starting
// them.
//
//   names, users, folders, programs, carriers ── checked here
//   values of the keys of a program of MPF ───── checked by the program: ProgramCheck
//
// Threads  the process must have one thread.
#pragma once

#include "base/toml/config_errors.h"
#include "crate/config/crate.h"

namespace mpf::crate {

// Adds all errors, each with its place in the crate file. Processes that are not sound are left
// out: their errors are known.
void checkStart(const Crate& crate, ConfigErrors& errors);

}  // namespace mpf::crate
