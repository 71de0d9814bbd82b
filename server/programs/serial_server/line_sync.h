// SPDX-License-Identifier: MIT
// LineSync: computes when the next request may be sent, so that no late answer is mistaken for its
// answer.
//
//   in step ── asked ──► outstanding ── answered ──► in step          settleTime of silence
//                            └─ unanswered ──► late ─┬─ seen ───────► quietTime of silence
//                                                    └─ resyncLimit ► quietTime of silence
//   in step ── input without a request ──► surplus ─────────────────► quietTime of silence
//
// Threads  one at a time. It reads no clock: times are CLOCK_MONOTONIC in nanoseconds.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "server/programs/serial_server/line_limits.h"

namespace mpf {

class LineSync {
 public:
  explicit LineSync(const LineLimits& limits) : limits_(limits) {}

  // The first byte of a write-read was sent. Its answer ends with `eom`, or after `maxBytes`; with
  // neither (empty, 0) any input counts as the answer.
  void asked(std::string eom, std::size_t maxBytes);
  void answered() noexcept;
  // The write-read ended without its complete answer, which may still arrive.
  void unanswered(std::int64_t nowNs) noexcept;
  // A request that expects no answer has ended.
  void written(std::int64_t nowNs) noexcept;
  // A byte arrived.
  void received(std::uint8_t byte, std::int64_t nowNs);
  // The line lost or damaged bytes: it is not silent.
  void disturbed(std::int64_t nowNs) noexcept { activeNs_ = nowNs; }
  // Input that no request had read was dropped.
  void noteSurplus() noexcept { hasSurplus_ = true; }

  // Whether input that no request reads is normal: the last request was not a write-read, and no
  // answer is outstanding.
  [[nodiscard]] bool isSurplusExpected() const noexcept { return !wasAsked_ && !late_; }
  // Whether the outstanding answer has arrived completely, or no answer is outstanding.
  [[nodiscard]] bool isWhole() const noexcept { return !late_ || late_->isWhole; }
  // When a write-read, or a plain write, may be sent if nothing else arrives.
  [[nodiscard]] std::int64_t readyAtNs(bool isQuestion) const noexcept;

 private:
  struct Late {
    std::string eom;
    std::size_t maxBytes = 0;
    std::size_t bytes = 0;
    std::string last;  // as many bytes as eom has
    bool isWhole = false;
    std::int64_t sinceNs = 0;  // when its request ended; 0: it has not
  };
  const LineLimits limits_;
  std::optional<Late> late_;
  bool wasAsked_ = false;  // the last request was a write-read
  bool hasSurplus_ = false;
  std::int64_t activeNs_ = 0;  // the last byte, or the end of the last plain write
};

}  // namespace mpf
