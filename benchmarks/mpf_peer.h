// SPDX-License-Identifier: MIT
// What the measurements of ours have in common.
#pragma once

#include <string>

#include <mpf/benchmarks/mode.h>
#include <mpf/server/message_server.h>

namespace mpf::bench {

inline constexpr const char* kMpf = "MPF";

[[nodiscard]] WaitMode waitMode(Mode mode) noexcept;
[[nodiscard]] ServerOptions serverOptions(Mode mode);
// Removes what killed processes left on a backplane.
void removeBackplane(const std::string& name) noexcept;

}  // namespace mpf::bench
