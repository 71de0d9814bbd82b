// SPDX-License-Identifier: MIT
// Standard descriptors: ensures that the descriptors 0, 1 and 2 are open.
//
// If a program starts with one of them closed, the next file that it opens gets this number: a
// serial line, a segment of shared memory, a socket. The program's output, such as its log, would
// be written to that file.
//
// Threads  call it first in main(), before there are other threads and before any file is opened.
#pragma once

namespace mpf {

// Opens /dev/null on each of the descriptors 0 to 2 that is closed; if /dev/null is missing, the
// root folder, which can be neither read nor written.
void openStandardDescriptors() noexcept;

// Closes `descriptor`. If it is 0, 1 or 2, its number is then open on /dev/null.
void closeDescriptor(int descriptor) noexcept;

}  // namespace mpf
