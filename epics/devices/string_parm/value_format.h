// SPDX-License-Identifier: MIT
// ValueFormat: a printf or scanf format of a user, for one value of type double or std::int32_t.
//
//   const ValueFormat<double> format("SOUR:VOLT %4.3lf", FormatUse::print);
//   format.print(1.5);                                                          SOUR:VOLT 1.500
//
// Only formats whose behaviour is defined are accepted: at most one conversion, of the value's
// type. Its length modifier may be "l" or absent, with the same result. A format for scanning may
// skip text: %*d, %*[^0-9].
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace mpf {

enum class FormatUse { print, scan };

template <class Value>  // double or std::int32_t
class ValueFormat {
 public:
  //   throws  std::invalid_argument, which says what is wrong with the format
  ValueFormat(std::string_view format, FormatUse use);

  [[nodiscard]] std::string print(Value value) const;
  //   returns  nullopt when the text does not match, the number does not fit, or the format has no
  //            conversion; %x and its kin: also 32 bits of an unsigned number
  [[nodiscard]] std::optional<Value> scan(const std::string& text) const;

 private:
  std::string format_;  // with the length modifier of the type that is passed
  char conversion_ = 0;  // 0: the format has no conversion
};

extern template class ValueFormat<double>;
extern template class ValueFormat<std::int32_t>;

}  // namespace mpf
