// SPDX-License-Identifier: MIT
// What the measurements of ours have in common.
#pragma once

#include <chrono>
#include <string>

#include <mpf/benchmarks/mode.h>
#include <mpf/server/message_server.h>

namespace mpf::bench {

inline constexpr const char* kMpf = "MPF";
inline constexpr const char* kServer = "bench";
inline constexpr auto kConnectLimit = std::chrono::seconds(10);

[[nodiscard]] WaitMode waitMode(Mode mode) noexcept;
[[nodiscard]] ServerOptions serverOptions(Mode mode);
// Begins the name of every backplane, queue and socket of a run; its pid follows.
inline constexpr const char* kRunPrefix = "mpf-bench-";
// Removes what killed processes left on backplanes whose names begin so. What belongs to a living process stays.
void removeBackplanes(const std::string& prefix) noexcept;

}  // namespace mpf::bench
