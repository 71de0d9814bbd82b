// SPDX-License-Identifier: MIT
// Guard: main() of the test executables runs the tests in a child process. If the child dies (by
// its watchdog, a sanitizer or a signal), the guard removes its processes, the segments of its
// backplanes and its temporary files.
//
//   main(): guard ─fork─► tests ─fork─► servers, clients, tools
//             └─ waits for the tests, kills their remaining children, removes their segments,
//                ends in the same way as the tests
//
// Threads  any.
#pragma once

#include <string>

namespace mpf::test {

// Registers a backplane of the running test: the guard removes its segments when the test dies.
void guardBackplane(const std::string& name);

}  // namespace mpf::test
