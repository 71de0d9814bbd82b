// SPDX-License-Identifier: MIT
// LinkOptions: what the parameters of an INP or OUT link of DTYP "MPF" say.
//
//   @<server>[:<location>] type=int32 cmd=1 address=3 timeout=2.5 mode=subscribe
//                          └──────────────────── parse() ───────────────────────┘
//
// The parameters are pairs <key>=<value>, separated by blanks or commas, each key at most once.
// docs/epics.md describes all keys.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string_view>

#include <mpf/message_types.h>

namespace mpf {

struct LinkOptions {
  enum class Mode { read, subscribe, write };
  // What raw values EGUL and EGUF stand for.
  struct Range {
    double low;
    double high;
  };
  // What holds for a record unless its link says otherwise.
  struct Defaults {
    MessageType type = MessageType::int32;
    Mode mode = Mode::read;  // Mode::write for output records
    bool canHaveBits = true;  // of numbers and bits, not of text, arrays and events
    bool canHaveRange = true;  // of ai and ao
  };

  MessageType type = MessageType::int32;  // of requests
  Mode mode = Mode::read;
  std::int32_t cmd = 0;
  std::int32_t address = 0;
  std::int32_t extra = 0;
  double value = 0;  // of a request that reads or subscribes
  std::optional<double> timeout{};  // [s]
  std::optional<std::uint32_t> mask{};
  std::optional<int> shift{};
  std::optional<Range> range{};
  std::optional<std::int32_t> readback{};  // cmd of the request that reads an output
  bool rewrite = false;

  //   throws  std::invalid_argument, which names the key and what is valid
  static LinkOptions parse(std::string_view text, const Defaults& defaults);

  // The field `timeout` of requests: whole seconds, at least the timeout of the link.
  [[nodiscard]] std::int32_t timeoutField() const noexcept;
  // Whether the link selects bits of the value of a message.
  [[nodiscard]] bool selectsBits() const noexcept { return mask.has_value() || shift.has_value(); }
};

}  // namespace mpf
