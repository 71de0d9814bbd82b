// SPDX-License-Identifier: MIT
// WithoutGil: releases the GIL for a scope, for functions that wait.
//
//   const WithoutGil unlocked;
//   wait(unlocked.interruption());   // runs signal handlers of Python, for example of Ctrl-C
//
// When the interpreter exits, CPython ends threads that ask for the GIL by pthread_exit(), which
// aborts a process in code of C++. prepareExit() runs before: from then on, a daemon thread that
// leaves such a scope stops for good instead of asking. Functions of Python may ask for it, too, so
// a thread is in the scope of a CallsPython while code of C++ calls them.
//
// Threads  any.
#pragma once

#include <cstddef>
#include <functional>
#include <nanobind/nanobind.h>
#include <span>

namespace mpf::python {

class WithoutGil {
 public:
  WithoutGil();
  ~WithoutGil();
  WithoutGil(const WithoutGil&) = delete;
  WithoutGil& operator=(const WithoutGil&) = delete;

  // Returns a function that runs the signal handlers of Python, and returns true when one of them
  // raised an exception, which is the current exception then. Valid as long as this object.
  [[nodiscard]] std::function<bool()> interruption();
  [[nodiscard]] bool wasInterrupted() const noexcept { return wasInterrupted_; }

 private:
  PyThreadState* state_;
  bool wasInterrupted_ = false;
};

// With the GIL. prepareExit() waits for threads in such a scope; a daemon thread that enters one
// later stops for good.
class CallsPython {
 public:
  CallsPython();
  ~CallsPython();
  CallsPython(const CallsPython&) = delete;
  CallsPython& operator=(const CallsPython&) = delete;
};

// Copies many bytes without the GIL.
void copyBytes(std::byte* to, std::span<const std::byte> from);

// To be called once: from then on, the child of a fork does not wait for the threads of its parent,
// which it does not have.
void forgetThreadsInForks();

// To be called by atexit, with the GIL, on the main thread.
void prepareExit();

}  // namespace mpf::python
