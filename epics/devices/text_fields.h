// SPDX-License-Identifier: MIT
// Texts of device support: escapes of users, ends of answers, VAL of records of strings.
//
// Threads  with the record locked, or before the IOC runs.
#pragma once

#include <algorithm>
#include <cstring>
#include <epicsString.h>
#include <lsiRecord.h>
#include <lsoRecord.h>
#include <string>
#include <string_view>
#include <stringinRecord.h>
#include <stringoutRecord.h>
#include <vector>

namespace mpf {

// Translates escapes such as \r.
inline std::string translated(std::string_view text) {
  std::vector<char> raw(text.size() + 1);
  const auto size = epicsStrnRawFromEscaped(raw.data(), raw.size(), text.data(), text.size());
  return {raw.data(), static_cast<std::size_t>(std::max(size, 0))};
}
// An answer without the CR and LF at its end.
inline std::string_view withoutLineEnd(std::string_view answer) {
  return answer.substr(0, answer.find_last_not_of("\r\n") + 1);
}

inline std::string valueOf(const stringoutRecord& record) {
  return {record.val, ::strnlen(record.val, sizeof record.val)};
}
inline std::string valueOf(const lsoRecord& record) {
  return {record.val, ::strnlen(record.val, record.sizv)};
}
// Stores as much of the text as VAL has room for.
inline void setValue(stringinRecord& record, std::string_view text) {
  record.val[text.copy(record.val, sizeof record.val - 1)] = '\0';
}
inline void setValue(lsiRecord& record, std::string_view text) {
  const auto size = text.copy(record.val, std::size_t{record.sizv} - 1);
  record.val[size] = '\0';
  record.len = static_cast<epicsUInt32>(size + 1);
}

}  // namespace mpf
