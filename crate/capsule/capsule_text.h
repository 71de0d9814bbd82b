// SPDX-License-Identifier: MIT
// capsuleText(): a capsule as text for people: one sentence that says what happened, then tables.
//
// Threads  any.
// Trust    a capsule may hold any JSON: absent members are shown as "?", and every text is cleaned.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace mpf::crate {

// `serial "serial" died by SIGSEGV 12.4 s after its start, while its server "com1" handled int32
// cmd 3 of client PROGRAM pid 123.`
[[nodiscard]] std::string capsuleSummary(const nlohmann::ordered_json& capsule);
[[nodiscard]] std::string capsuleText(const nlohmann::ordered_json& capsule);

}  // namespace mpf::crate
