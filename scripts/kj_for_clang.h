// SPDX-License-Identifier: MIT
// For clang-tidy and `make fuzz` only, included before everything: two operators that kj/string.h
// 0.9 (Debian 12) leaves to C++20's rewriting of ==, which clang 16 and newer do not do where a
// matching != exists (P2468). g++ 12 does.
#pragma once

#include <kj/string.h>

namespace kj {
inline bool operator==(const char* a, const StringPtr& b) { return b == StringPtr(a); }
inline bool operator!=(const char* a, const StringPtr& b) { return b != StringPtr(a); }
}  // namespace kj
