// SPDX-License-Identifier: MIT
// jsonText(): a JSON document as all subcommands print it. It is valid JSON and safe to show on a
// terminal even if its texts hold arbitrary bytes: bytes that are not UTF-8 become U+FFFD; control
// and format characters are escaped, as in \u202e.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "base/printable.h"

namespace mpf::tools {

// Indented by `indent` blanks; on one line if `indent` is -1.
template <class Json>
[[nodiscard]] std::string jsonText(const Json& json, int indent = 2) {
  return printableJson(json.dump(indent, ' ', false, Json::error_handler_t::replace));
}

}  // namespace mpf::tools
