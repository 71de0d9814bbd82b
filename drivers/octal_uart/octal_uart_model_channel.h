// SPDX-License-Identifier: MIT
// OctalUartModelChannel: one channel of the chip of an OctalUartModel: what is in it, and its line.
//
//   THR ─► shift register ─► line                     line ─► shift register ─► FIFO of 3, each with its status ─► RHR
//
// Threads  none of its own: the model's lock is held.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "drivers/octal_uart/octal_uart_settings.h"
#include "drivers/serial/serial_line.h"

namespace mpf {

class OctalUartModelChannel {
 public:
  static constexpr std::size_t kFifoBytes = 3;

  // --- as the processor sees it
  [[nodiscard]] std::uint8_t readMr();
  [[nodiscard]] std::uint8_t readSr() const;
  [[nodiscard]] std::uint8_t readRhr();
  void writeMr(std::uint8_t value);
  void writeCsr(std::uint8_t value) { mode_.csr = value; }
  void writeCr(std::uint8_t value);
  void writeThr(std::uint8_t value);
  // Its bits of ISR, as those of channel a.
  [[nodiscard]] std::uint8_t isr() const;

  // --- as the line sees it
  // What comes next, and what has gone out.
  std::deque<LineByte> incoming;
  std::string outgoing;
  void setClearToSend(bool clear) { clearToSend_ = clear; }
  // RTSN is low: somebody may send, or of RS-485 this one does.
  [[nodiscard]] bool requestsToSend() const;
  [[nodiscard]] bool isBreaking() const { return isBreaking_; }
  [[nodiscard]] int breaks() const { return breaks_; }
  // Bytes that came and were overwritten before they were read, or while the receiver was disabled.
  [[nodiscard]] std::uint64_t overrun() const { return overrun_; }
  [[nodiscard]] std::uint64_t unheard() const { return unheard_; }
  [[nodiscard]] SerialSettings settings() const { return settingsOf(mode_); }

  // --- time
  // Lets happen what happens until then. A byte takes no time and comes when there is room for it,
  // or the time that it takes on the line.
  //   mayLag  time that nobody looked did not pass: late bytes come one after the other, not all at
  //           once
  void runUntil(std::int64_t nowNs, bool takesTime, bool mayLag);
  // When the next byte has come or gone, at the speeds that are set; INT64_MAX: never, as it looks
  // now.
  [[nodiscard]] std::int64_t nextEventNs() const;

 private:
  struct Received {
    std::uint8_t value = 0;
    std::uint8_t status = 0;
  };
  [[nodiscard]] std::int64_t byteNs() const;
  [[nodiscard]] bool isLooped() const;
  [[nodiscard]] bool maySend() const;
  void start(std::int64_t nowNs);
  void finish();
  void arrive(LineByte byte);
  void fillFifo();
  void runInstantly();
  void setBreak(bool on);

  OctalUartMode mode_;
  bool pointsToMr2_ = false;
  bool isRxEnabled_ = false, isTxEnabled_ = false;
  bool rts_ = false, clearToSend_ = true;
  bool isBreaking_ = false, hasBreakChanged_ = false, hasOverrun_ = false;
  std::deque<Received> fifo_;
  std::optional<Received> rxShift_;  // waits for room in the FIFO
  std::optional<std::uint8_t> thr_, txShift_;
  std::int64_t sentAtNs_ = 0;  // when txShift_ is out
  std::optional<std::int64_t> arrivesAtNs_;  // when the first of incoming is in
  int breaks_ = 0;
  std::uint64_t overrun_ = 0, unheard_ = 0;
};

}  // namespace mpf
