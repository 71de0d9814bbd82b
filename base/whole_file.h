// SPDX-License-Identifier: MIT
// Reads small files, and the ends of large ones.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace mpf {

// Returns the whole content of a file.
//   throws  std::system_error
[[nodiscard]] std::string readWholeFile(const std::string& file);

struct EndOfFile {
  std::string text;
  std::uint64_t leftOutBytes = 0;  // before the text
};

// Returns the last `limit` bytes of a file; of a named pipe, none.
//   throws  std::system_error
[[nodiscard]] EndOfFile readEndOfFile(const std::string& file, std::size_t limit);

}  // namespace mpf
