// SPDX-License-Identifier: MIT
// LineFaults: reports lost and damaged bytes of a serial line, in the log and in replies.
//
//   port's counters ── look() ──► one alarm for each fault
//                            └──► a line of the log with the counts since the start
//   an answer's faults ──► status and `extra` of its reply (include/mpf/serial_commands.h)
//
// The log limits lines of one kind (LogLimiter). Each line has the counts since the start, so that
// a line that stands for many others contains the sum of all faults.
//
// Threads  any thread calls look(): the port's thread after each fault, the server's thread after
//          each request. The server's thread calls the other functions.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>

#include <mpf/drivers/serial/serial_port.h>
#include <mpf/message_server.h>
#include <mpf/message_types.h>

#include "server/programs/server_log.h"

namespace mpf {

// The serialFault... bit of <mpf/serial_commands.h> for a fault; 0 for LineFault::none.
[[nodiscard]] std::uint8_t faultBit(LineFault fault) noexcept;

class LineFaults {
 public:
  // Does not report earlier faults. The arguments must outlive this object.
  LineFaults(MessageServer& server, const SerialPort& port, const ServerLog& log);
  // Reports the faults since the last look().
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
    friend Counts operator-(const Counts& a, const Counts& b) noexcept {
      return {a.overruns - b.overruns, a.parity - b.parity, a.framing - b.framing,
              a.breaks - b.breaks};
    }
  };
  [[nodiscard]] Counts counted() const;
  [[nodiscard]] static std::string textOf(const Counts& counts);

  MessageServer& server_;
  const SerialPort& port_;
  const ServerLog& log_;
  const Counts start_;
  std::uint8_t answer_ = 0;
  std::mutex mutex_;
  Counts reported_;  // under mutex_: what the port had counted at the last look()
};

}  // namespace mpf
