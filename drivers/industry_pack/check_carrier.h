// SPDX-License-Identifier: MIT
// checkCarrier(): checks the kind and the parameters of a carrier without opening its board.
//
// Threads  any.
#pragma once

#include <cstddef>
#include <string>

namespace mpf {

// Returns the number of its sites. `text` is KIND[:PARAMETERS], as for --carrier.
//   throws  as createCarrier(), except errors of the board
std::size_t checkCarrier(const std::string& text);

}  // namespace mpf
