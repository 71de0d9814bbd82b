// SPDX-License-Identifier: MIT
// MPF_NEEDS_A_CHILD: begins a test whose forked child starts threads, and skips it where that is
// impossible.
#pragma once

#include <gtest/gtest.h>

#ifdef __SANITIZE_THREAD__
#define MPF_NEEDS_A_CHILD \
  GTEST_SKIP() << "ThreadSanitizer allows no threads in the child of a process that has some"
#else
#define MPF_NEEDS_A_CHILD
#endif
