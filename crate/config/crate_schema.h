// SPDX-License-Identifier: MIT
// crateSchema(): the keys of crate files as a JSON schema, with which editors complete and check
// them.
#pragma once

#include <nlohmann/json.hpp>

namespace mpf::crate {

// A schema of JSON Schema draft 2020-12.
[[nodiscard]] nlohmann::ordered_json crateSchema();

}  // namespace mpf::crate
