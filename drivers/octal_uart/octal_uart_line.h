// SPDX-License-Identifier: MIT
// OctalUartLine: a channel of an OctalUart as a SerialLine. Its descriptor joins the bell of the
// channel with a timer, which RS-485 needs to switch the transmitter off.
//
// Threads  the port's thread.
// Crash    see OctalUart.
// Trust    see SerialPort.
#pragma once

#include <optional>
#include <string>

#include <mpf/file_descriptor.h>

#include "drivers/octal_uart/octal_uart.h"
#include "drivers/serial/serial_line.h"

namespace mpf {

class OctalUartLine final : public SerialLine {
 public:
  // Reserves port `number` of the module; tryOpen() sets it up.
  //   uart      outlives this object
  //   settings  a field that is 0 means the usual value: 9600 baud, 8 bits, no parity, 1 stop bit,
  //             no flow control
  //   throws    std::invalid_argument for settings that the chip does not support, and when the
  //             module has no such port or the port is in use
  OctalUartLine(OctalUart& uart, int number, const SerialSettings& settings);
  ~OctalUartLine() override;

  [[nodiscard]] std::string description() const override { return description_; }
  [[nodiscard]] std::string problem() const override { return problem_; }
  [[nodiscard]] OpenState tryOpen() override;
  [[nodiscard]] std::chrono::milliseconds openTimeout() const override { return {}; }
  void close() noexcept override;
  [[nodiscard]] pollfd waitsFor() const noexcept override { return {events_.get(), POLLIN, 0}; }
  [[nodiscard]] bool tryRead(std::vector<LineByte>& bytes) override;
  [[nodiscard]] std::optional<std::size_t> tryWrite(std::span<const std::uint8_t> bytes) override;
  [[nodiscard]] std::chrono::milliseconds timeToSend() const override;
  void discardUnsent() noexcept override;
  [[nodiscard]] std::uint64_t takeOverruns() noexcept override;
  [[nodiscard]] std::string tryConfigure(const SerialSettings& settings) override;
  [[nodiscard]] bool trySetBreak(bool on) noexcept override;

 private:
  bool isThere(OctalUartChannel& channel);
  void turnOrWait(OctalUartChannel& channel) const;

  OctalUart& uart_;
  const int number_;
  const std::string description_;
  SerialSettings settings_;
  std::string problem_;
  std::uint64_t overruns_ = 0;  // of the bytes that tryRead() has returned
  FileDescriptor timer_;  // RS-485: the next call of tryTurn()
  // epoll of the channel's bell and the timer; unlike the bell alone, it is never writable
  FileDescriptor events_;
};

}  // namespace mpf
