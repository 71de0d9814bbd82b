// SPDX-License-Identifier: MIT
// What each fuzzer is: a function of its own that plays one input (fuzzer.cpp hands it to
// libFuzzer, or to replay.cpp).
#pragma once

#include <cstdint>
#include <span>

namespace mpf::test {

// Leaves nothing behind that the next input could see.
void play(std::span<const std::uint8_t> input);

}  // namespace mpf::test
