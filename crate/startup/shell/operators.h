// SPDX-License-Identifier: MIT
// The operators of the vxWorks shell on Values, with the rules of C: integers, floating point,
// and pointers into strings.
//
// Threads  any.
// Trust    no operand causes undefined behaviour; what has no result throws LineError.
#pragma once

#include <string_view>

#include "crate/startup/shell/value.h"

namespace mpf::startup {

// The precedence of a binary operator, from 1, the lowest; 0: not a binary operator.
[[nodiscard]] int precedenceOf(std::string_view symbol);

//   column  of the operator, for errors
[[nodiscard]] Value applyBinary(std::string_view symbol, const Value& left, const Value& right,
                                std::size_t column);
// - + ! ~, and * for the character at a pointer
[[nodiscard]] Value applyUnary(std::string_view symbol, const Value& operand, std::size_t column);

}  // namespace mpf::startup
