// SPDX-License-Identifier: MIT
// Whether this build has a sanitizer. Everything then takes ten times as long, so tests with many
// repetitions do fewer of them.
#pragma once

namespace mpf::test {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kIsSanitized = true;
#else
inline constexpr bool kIsSanitized = false;
#endif

}  // namespace mpf::test
