// SPDX-License-Identifier: MIT
// LateLine: a line whose hardware may be absent when its port is created. It creates the real line
// when the hardware is present. Until then each attempt to open it fails, and problem() says what
// is missing.
//
//   const auto makeLine = [&] { return std::make_unique<OctalUartLine>(uart(), 3, settings); };
//   PolledSerialPort port(std::make_unique<LateLine>("port 3 of UART0", makeLine), true);
//
// Threads  the port's thread.
// Trust    see the line that `make` returns.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "drivers/serial/serial_line.h"

namespace mpf {

class LateLine final : public SerialLine {
 public:
  // Creates the real line. Called at each attempt to open, until it returns; throws a
  // std::exception that says what is missing.
  using Make = std::function<std::unique_ptr<SerialLine>()>;

  LateLine(std::string description, Make make);

  [[nodiscard]] std::string description() const override { return description_; }
  [[nodiscard]] std::string problem() const override { return line_ ? line_->problem() : problem_; }
  [[nodiscard]] OpenState tryOpen() override;
  [[nodiscard]] std::chrono::milliseconds openTimeout() const override;
  void close() noexcept override;
  [[nodiscard]] pollfd waitsFor() const noexcept override;
  [[nodiscard]] bool tryRead(std::vector<LineByte>& bytes) override;
  [[nodiscard]] std::optional<std::size_t> tryWrite(std::span<const std::uint8_t> bytes) override;
  [[nodiscard]] std::chrono::milliseconds timeToSend() const override;
  void discardUnsent() noexcept override;
  [[nodiscard]] std::uint64_t takeOverruns() noexcept override;
  [[nodiscard]] std::string tryConfigure(const SerialSettings& settings) override;
  [[nodiscard]] bool trySetBreak(bool on) noexcept override;

 private:
  const std::string description_;
  const Make make_;
  std::string problem_;
  std::unique_ptr<SerialLine> line_;  // nullptr until make_ has returned
};

}  // namespace mpf
