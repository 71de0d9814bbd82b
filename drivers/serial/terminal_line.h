// SPDX-License-Identifier: MIT
// TerminalLine: a terminal device as a SerialLine, opened exclusively and in raw mode.
//
//   open ─► isatty ─► flock ─► TIOCEXCL ─► raw mode ─► settings ─► open
//
// A read() that returns 0 or an error other than EAGAIN means that the device is gone.
//
// Threads  the port's thread.
// Crash    the kernel closes the device, which ends the lock and the exclusive mode.
// Trust    the lock keeps out other ports of MPF and the programs that flock() terminals; TIOCEXCL
//          keeps out all other programs, except those of root.
#pragma once

#include <string>

#include <mpf/file_descriptor.h>

#include "drivers/serial/mark_decoder.h"
#include "drivers/serial/serial_line.h"
#include "drivers/serial/terminal_errors.h"

namespace mpf {

class TerminalLine : public SerialLine {
 public:
  //   throws  std::invalid_argument for settings that problemOf() refuses
  TerminalLine(std::string device, const SerialSettings& settings);
  ~TerminalLine() override { closeDevice(); }

  [[nodiscard]] std::string description() const override { return device_; }
  [[nodiscard]] std::string problem() const override { return problem_; }
  [[nodiscard]] OpenState tryOpen() override;
  [[nodiscard]] std::chrono::milliseconds openTimeout() const override { return {}; }
  void close() noexcept override { closeDevice(); }
  [[nodiscard]] pollfd waitsFor() const noexcept override { return {fd_.get(), POLLIN, 0}; }
  [[nodiscard]] bool tryRead(std::vector<LineByte>& bytes) override;
  [[nodiscard]] std::optional<std::size_t> tryWrite(std::span<const std::uint8_t> bytes) override;
  [[nodiscard]] std::chrono::milliseconds timeToSend() const override;
  void discardUnsent() noexcept override;
  [[nodiscard]] std::uint64_t takeOverruns() noexcept override;
  [[nodiscard]] std::string tryConfigure(const SerialSettings& settings) override;
  [[nodiscard]] bool trySetBreak(bool on) noexcept override;

 private:
  [[nodiscard]] std::string tryPrepare() const;
  [[nodiscard]] std::optional<TerminalErrors::Counts> errorCounts() const noexcept;
  void append(std::span<const std::uint8_t> raw, std::vector<LineByte>& bytes);
  void closeDevice() noexcept;
  void note(const char* call, int error);

  const std::string device_;
  SerialSettings settings_;
  std::string problem_;
  FileDescriptor fd_;
  MarkDecoder decoder_;
  TerminalErrors errors_;
};

}  // namespace mpf
