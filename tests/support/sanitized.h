// SPDX-License-Identifier: MIT
// Whether this build has a sanitizer, with which everything takes ten times as long: tests that
// count do less of the same then.
#pragma once

namespace mpf::test {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kIsSanitized = true;
#else
inline constexpr bool kIsSanitized = false;
#endif

}  // namespace mpf::test
