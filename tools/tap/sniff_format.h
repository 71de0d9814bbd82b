// SPDX-License-Identifier: MIT
// SniffFormat: how the bytes of a line are shown.
//
//   lines    14:03:27.120   0.0 ms  T  *IDN?\n          one direction a line, until its end of
//            line, a pause or a turn
//   manual   T31 T34 R31 T35 R34 T00 R35 R00 T31 T34 14154.5.14        ten bytes a line (manual,
//            "serialPortSniff")
//   json     {"at_ns": 81234000000, "kind": "T", "value": 49}          one object a byte
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
  // Text that can be shown now; what is begun stays for later.
  [[nodiscard]] virtual std::string add(const serial::SniffRecord& record) = 0;
  [[nodiscard]] virtual std::string missing(std::uint64_t bytes) = 0;
  // What was begun: at a pause, and at the end.
  [[nodiscard]] virtual std::string flush() = 0;

  // `name` is lines, manual or json.
  //   realtimeOffsetNs  wall clock minus CLOCK_MONOTONIC
  static std::unique_ptr<SniffFormat> make(const std::string& name, std::int64_t realtimeOffsetNs);
};

}  // namespace mpf::tools
