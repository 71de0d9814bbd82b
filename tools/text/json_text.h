// SPDX-License-Identifier: MIT
// jsonText(): a JSON document as all subcommands print it: valid, whatever bytes its texts hold,
// and safe to show on a terminal. Bytes that are not UTF-8 become U+FFFD; control and format
// characters are written as \u202e.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "base/printable.h"

namespace mpf::tools {

// Indented by `indent`; -1: in one line.
template <class Json>
[[nodiscard]] std::string jsonText(const Json& json, int indent = 2) {
  return printableJson(json.dump(indent, ' ', false, Json::error_handler_t::replace));
}

}  // namespace mpf::tools
