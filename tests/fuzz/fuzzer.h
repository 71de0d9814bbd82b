// SPDX-License-Identifier: MIT
// The interface of each fuzzer: play() runs one input. fuzzer.cpp passes it to libFuzzer or to
// replay.cpp.
#pragma once

#include <cstdint>
#include <span>

namespace mpf::test {

// Leaves no state for the next input.
void play(std::span<const std::uint8_t> input);

}  // namespace mpf::test
