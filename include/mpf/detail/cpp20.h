// SPDX-License-Identifier: MIT
// Ends a compilation with an older standard at once, with an error that says what to do.
#pragma once

#if __cplusplus < 202002L
#error "MPF needs C++20: compile with -std=c++20"
#endif
