// SPDX-License-Identifier: MIT
// Included before every source, by clang-tidy and `make fuzz` only. Defines two operators that
// kj/string.h 0.9 (Debian 12) expects from C++20's rewriting of ==. clang 16 and newer do not
// rewrite == if a matching != exists (P2468); g++ 12 does.
#pragma once

#include <kj/string.h>

namespace kj {
inline bool operator==(const char* a, const StringPtr& b) { return b == StringPtr(a); }
inline bool operator!=(const char* a, const StringPtr& b) { return b != StringPtr(a); }
}  // namespace kj
