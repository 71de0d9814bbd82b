// SPDX-License-Identifier: MIT
// LateLine: a line that can be made only once its hardware is there. Until then it cannot be
// opened, and says what is missing.
//
//   PolledSerialPort port(std::make_unique<LateLine>("port 3 of UART0", [&] { return
//   std::make_unique<OctalUartLine>(uart(), 3, settings); }), true);
//
// Threads  the port's thread.
// Trust    as that of the line that is made.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "drivers/serial/serial_line.h"

namespace mpf {

class LateLine final : public SerialLine {
 public:
  // Runs at each attempt to open the line, until it does not throw; what it throws, a
  // std::exception, says what is missing.
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
  std::unique_ptr<SerialLine> line_;  // null until it could be made
};

}  // namespace mpf
