// SPDX-License-Identifier: MIT
// GpibSniffFormat: formats the bytes of a GPIB bus.
//
//   manual   T_?V
//            R-8.874270409E-01 0x0d 0x0a
//            A line for each direction, as in the manual ("gpibSniff"): _ is UNT, ? is UNL, V is
//            the talk address of instrument 22. Bytes that are not printable are hexadecimal.
//   decode   14:03:27.120   +0.0 ms  T  UNT, UNL, TAG 22
//            14:03:27.121   +0.8 ms  R  "-8.874270409E-01\r\n", EOI
//            A line for each sequence of commands, and for data of one direction up to EOI or a
//            pause.
//   json     {"at_ns": 81234000000, "direction": "T", "atn": true, "eoi": false, "value": 86}
//            One object for each byte.
//
// Threads  one.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <mpf/gpib_sniff.h>

namespace mpf::tools {

class GpibSniffFormat {
 public:
  virtual ~GpibSniffFormat() = default;
  [[nodiscard]] static auto tryRead(const Char8ArrayMessage& message) {
    return gpib::tryReadRecords(message);
  }
  // Adds a byte. Returns what can be printed; an incomplete line may be kept.
  [[nodiscard]] virtual std::string add(const gpib::SniffRecord& record) = 0;
  [[nodiscard]] virtual std::string missing(std::uint64_t bytes) = 0;
  // Returns what was kept: for pauses of the bus, and the end.
  [[nodiscard]] virtual std::string flush() = 0;
  // Returns what follows the last line.
  [[nodiscard]] virtual std::string end() { return {}; }

  // `name` is manual, decode or json.
  //   realtimeOffsetNs  wall clock minus CLOCK_MONOTONIC
  static std::unique_ptr<GpibSniffFormat> make(const std::string& name,
                                               std::int64_t realtimeOffsetNs);
};

// The name of a byte that was sent with ATN: "UNL", "LAG 22", "SAD 5"; "0x02" when it has none.
[[nodiscard]] std::string gpibCommandName(std::uint8_t command);

}  // namespace mpf::tools
