// SPDX-License-Identifier: MIT
// The fuzzers. Each function runs one input, and leaves no state for the next one. fuzzers.cpp
// passes the inputs of libFuzzer, or of replay.cpp, to one of them.
#pragma once

#include <cstdint>
#include <span>

namespace mpf::test {

void playClient(std::span<const std::uint8_t> input);
void playServer(std::span<const std::uint8_t> input);
void playTools(std::span<const std::uint8_t> input);
void playRecording(std::span<const std::uint8_t> input);
void playFrames(std::span<const std::uint8_t> input);
void playStartup(std::span<const std::uint8_t> input);
void playServerRouter(std::span<const std::uint8_t> input);
void playClientRouter(std::span<const std::uint8_t> input);

}  // namespace mpf::test
