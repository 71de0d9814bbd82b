// SPDX-License-Identifier: MIT
// SniffFormat: formats the bytes of a serial line.
//
//   lines    14:03:27.120   0.0 ms  T  *IDN?\n
//            One direction in each line, which ends at '\n', at a pause, or when the direction
//            turns.
//   manual   T31 T34 R31 T35 R34 T00 R35 R00 T31 T34 14154.5.14
//            Ten bytes in each line (manual, "serialPortSniff").
//   json     {"at_ns": 81234000000, "kind": "T", "value": 49}
//            One object for each byte.
//
// Threads  one.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <mpf/serial_sniff.h>

namespace mpf::tools {

class SniffFormat {
 public:
  virtual ~SniffFormat() = default;
  [[nodiscard]] static auto tryRead(const Char8ArrayMessage& message) {
    return serial::tryReadRecords(message);
  }
  // Adds a byte. Returns the complete lines; an incomplete line is kept.
  [[nodiscard]] virtual std::string add(const serial::SniffRecord& record) = 0;
  [[nodiscard]] virtual std::string missing(std::uint64_t bytes) = 0;
  // Returns the incomplete line: for pauses of the line, and the end.
  [[nodiscard]] virtual std::string flush() = 0;
  // Returns what follows the last line.
  [[nodiscard]] static std::string end() { return {}; }

  // `name` is lines, manual or json.
  //   realtimeOffsetNs  wall clock minus CLOCK_MONOTONIC
  static std::unique_ptr<SniffFormat> make(const std::string& name, std::int64_t realtimeOffsetNs);
};

}  // namespace mpf::tools
