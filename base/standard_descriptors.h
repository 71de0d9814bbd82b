// SPDX-License-Identifier: MIT
// Standard descriptors: makes sure that 0, 1 and 2 are open.
//
// A program that starts with one of them closed would get its number for the next file that it
// opens: a serial line, a segment of shared memory, a socket. What the program then prints, such as
// its log, would go there.
//
// Threads  call it first in main(), before there are other threads and before any file is opened.
#pragma once

namespace mpf {

// Opens each of the descriptors 0 to 2 that is closed on /dev/null; where there is no /dev/null, on
// the root folder, which can be neither read nor written.
void openStandardDescriptors() noexcept;

// Closes `descriptor`; of 0 to 2 the number stays in use, for /dev/null.
void closeDescriptor(int descriptor) noexcept;

}  // namespace mpf
