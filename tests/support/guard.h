// SPDX-License-Identifier: MIT
// Guard: main() of the test executables runs the tests in a child process and removes what the
// child leaves when it dies, be it killed by its watchdog, a sanitizer or a signal: processes,
// segments of its backplanes, temporary files.
//
//   main(): guard ─fork─► tests ─fork─► servers, clients, tools
//             └─ waits for the tests, kills what is left of their children, removes their segments, ends as the tests did
//
// Threads  any.
#pragma once

#include <string>

namespace mpf::test {

// Registers a backplane of the running test: the guard removes its segments when the test dies.
void guardBackplane(const std::string& name);

}  // namespace mpf::test
