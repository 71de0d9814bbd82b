// SPDX-License-Identifier: MIT
// TerminalLine: the line of a PosixTerminalPort: a terminal device, opened exclusively, raw, with
// its settings.
//
//   open ─ is it a terminal? ─ lock ─ TIOCEXCL ─ raw ─ settings         read: 0, EIO, ENXIO: the device is gone
//
// Threads  the port's thread.
// Crash    the kernel closes the device, which ends lock and exclusiveness.
// Trust    the lock keeps out other ports of ours and the programs that flock() terminals; TIOCEXCL
//          all others but root's.
#pragma once

#include <string>

#include <mpf/file_descriptor.h>

#include "drivers/serial/mark_decoder.h"
#include "drivers/serial/serial_line.h"
#include "drivers/serial/terminal_errors.h"

namespace mpf {

class TerminalLine : public SerialLine {
 public:
  // Throws std::invalid_argument for settings that no line can have.
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
