// SPDX-License-Identifier: MIT
// OctalUartModelChannel: one channel in the chip of an OctalUartModel, and its line.
//
//   THR ─► shift register ─► line
//   line ─► shift register ─► FIFO of 3 bytes, each with its status ─► RHR
//
// Threads  the caller holds the lock of the model.
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

  // --- the registers
  [[nodiscard]] std::uint8_t readMr();
  [[nodiscard]] std::uint8_t readSr() const;
  [[nodiscard]] std::uint8_t readRhr();
  void writeMr(std::uint8_t value);
  void writeCsr(std::uint8_t value) { mode_.csr = value; }
  void writeCr(std::uint8_t value);
  void writeThr(std::uint8_t value);
  // The bits of this channel in ISR, at the positions of channel a.
  [[nodiscard]] std::uint8_t isr() const;

  // --- the line
  // The bytes that the far end sends, and all bytes that it has received.
  std::deque<LineByte> incoming;
  std::string outgoing;
  void setClearToSend(bool clear) { clearToSend_ = clear; }
  // Returns whether RTSN is low: the far end may send; on RS-485, the transmitter is on.
  [[nodiscard]] bool requestsToSend() const;
  [[nodiscard]] bool isBreaking() const { return isBreaking_; }
  [[nodiscard]] int breaks() const { return breaks_; }
  // Received bytes that were overwritten before they were read.
  [[nodiscard]] std::uint64_t overrun() const { return overrun_; }
  // Bytes that arrived while the receiver was disabled.
  [[nodiscard]] std::uint64_t unheard() const { return unheard_; }
  [[nodiscard]] SerialSettings settings() const { return settingsOf(mode_); }

  // --- time
  // Advances the channel to the time `nowNs`.
  //   takesTime  true: a byte takes the time of the baud rate; false: a byte takes no time, and
  //              arrives when there is room for it
  //   mayLag     true: bytes that are late because this function was called late arrive one after
  //              the other, as on a line, and not all at once
  void runUntil(std::int64_t nowNs, bool takesTime, bool mayLag);
  // When the next byte has been sent or received at the present baud rate; INT64_MAX: no byte is on
  // the line.
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
  std::int64_t sentAtNs_ = 0;  // when txShift_ has been sent
  std::optional<std::int64_t> arrivesAtNs_;  // when the first byte of incoming has been received
  int breaks_ = 0;
  std::uint64_t overrun_ = 0, unheard_ = 0;
};

}  // namespace mpf
