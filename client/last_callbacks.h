// SPDX-License-Identifier: MIT
// last_callbacks: lets exit() wait for threads of shared dispatchers that end after a callback. The
// callback has destroyed the last client of its dispatcher, so no other thread joins this
// one, which must still remove the files of the dispatcher.
//
// Threads  any.
#pragma once

namespace mpf::last_callbacks {

// Before the other functions, in this process. Throws std::bad_alloc.
void prepare();
// The calling thread ends after its callback: exit() waits for it.
void begin() noexcept;
// The calling thread has removed its files. After begin().
void end() noexcept;

}  // namespace mpf::last_callbacks
