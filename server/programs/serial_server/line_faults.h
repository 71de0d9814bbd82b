// SPDX-License-Identifier: MIT
// LineFaults: reports lost and damaged bytes of a serial line, in the log and in replies.
//
//   port's counters ── look() ──► one alarm for each fault
//                            └──► log, at most one line in `quiet`, with the counts since the last
//   an answer's faults ──► status and `extra` of its reply (include/mpf/serial_commands.h)
//
// Threads  any thread calls look(): the port's thread after each fault, the server's thread after
//          each request. The server's thread calls the functions for answers.
// Trust    a line that fails all the time causes one line of the log in each `quiet`.
#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>

#include <mpf/clock.h>
#include <mpf/drivers/serial/serial_port.h>
#include <mpf/message_server.h>
#include <mpf/message_types.h>

#include "server/programs/server_log.h"

namespace mpf {

// The serialFault... bit of <mpf/serial_commands.h> for a fault; 0 for LineFault::none.
[[nodiscard]] std::uint8_t faultBit(LineFault fault) noexcept;

class LineFaults {
 public:
  static constexpr std::chrono::seconds kQuiet{10};

  // Does not report earlier faults. The arguments must outlive this object.
  LineFaults(MessageServer& server, const SerialPort& port, const ServerLog& log,
             std::chrono::milliseconds quiet = kQuiet);
  // Logs the faults that were not logged yet.
  ~LineFaults();
  LineFaults(const LineFaults&) = delete;
  LineFaults& operator=(const LineFaults&) = delete;

  // Reports the faults that the port has counted since the last call.
  void look();

  // Sets the fault bits of the present answer; 0 at the beginning of each attempt.
  void setAnswer(std::uint8_t faults) noexcept { answer_ = faults; }
  [[nodiscard]] bool hasAnswerFaults() const noexcept { return answer_ != 0; }
  // The status of an answer that would have had `status` without its faults.
  [[nodiscard]] std::int32_t statusOf(std::int32_t status) const noexcept;
  // Sets `extra`, by the status that `reply` has.
  void describe(Char8Array& reply) const noexcept;

 private:
  struct Counts {
    std::uint64_t overruns = 0, parity = 0, framing = 0, breaks = 0;
    [[nodiscard]] std::uint64_t sum() const noexcept {
      return overruns + parity + framing + breaks;
    }
  };
  [[nodiscard]] Counts counted() const;
  void tell(std::int64_t nowNs);
  [[nodiscard]] static std::string textOf(const Counts& counts, const std::string& when);

  MessageServer& server_;
  const SerialPort& port_;
  const ServerLog& log_;
  const Nanoseconds quiet_;
  std::uint8_t answer_ = 0;
  std::mutex mutex_;  // all below
  Counts seen_;
  Counts untold_;
  std::int64_t untoldSinceNs_ = 0;
  std::int64_t nextLineNs_ = 0;
};

}  // namespace mpf
