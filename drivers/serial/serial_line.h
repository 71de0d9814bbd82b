// SPDX-License-Identifier: MIT
// SerialLine: what differs between kinds of line. All else about a port is in PolledSerialPort.
//
//             tryOpen()                           read(), tryWrite() say gone
//   closed ──────────────► open ─────────────────────────────────────────────► close()
//      └──► opening ──► tryOpen() again, each time waitsFor() is ready
//
// Threads  the port's thread alone. Nothing here blocks.
#pragma once

#include <poll.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <mpf/drivers/serial/peek_taps.h>
#include <mpf/drivers/serial/serial_settings.h>

namespace mpf {

struct LineByte {
  std::uint8_t value = 0;
  LineFault fault = LineFault::none;
  bool followsGap = false;  // bytes may be missing between the byte before and this one

  friend bool operator==(const LineByte&, const LineByte&) = default;
};

// Bytes that a line takes from the kernel at once.
inline constexpr std::size_t kReadBytes = 4096;

class SerialLine {
 public:
  enum class OpenState : std::uint8_t { opening, open, failed };

  SerialLine() = default;
  SerialLine(const SerialLine&) = delete;
  SerialLine& operator=(const SerialLine&) = delete;
  virtual ~SerialLine() = default;

  [[nodiscard]] virtual std::string description() const = 0;
  // What went wrong last: the call, the object and the reason.
  [[nodiscard]] virtual std::string problem() const = 0;

  [[nodiscard]] virtual OpenState tryOpen() = 0;
  // How long an attempt may take.
  [[nodiscard]] virtual std::chrono::milliseconds openTimeout() const = 0;
  virtual void close() noexcept = 0;
  // What to poll: for tryOpen() while opening, for bytes while open.
  [[nodiscard]] virtual pollfd waitsFor() const noexcept = 0;

  // Appends what has come, without waiting. Returns false when the line is gone.
  [[nodiscard]] virtual bool tryRead(std::vector<LineByte>& bytes) = 0;
  // Returns how many bytes the kernel took, nullopt when the line is gone.
  [[nodiscard]] virtual std::optional<std::size_t> tryWrite(
      std::span<const std::uint8_t> bytes) = 0;
  // Bytes that the kernel has taken and not sent yet, as the time that they need; 0 when all are
  // out or nobody knows.
  [[nodiscard]] virtual std::chrono::milliseconds timeToSend() const { return {}; }
  virtual void discardUnsent() noexcept {}
  // Bytes lost on the way since the last call. Where they are missing, LineByte::followsGap says as
  // exactly as the line can.
  [[nodiscard]] virtual std::uint64_t takeOverruns() noexcept { return 0; }

  // Returns empty, or what this line does not accept; then nothing has changed. Settings are
  // applied again by each tryOpen().
  [[nodiscard]] virtual std::string tryConfigure(const SerialSettings& settings) = 0;
  [[nodiscard]] virtual bool trySetBreak(bool on) noexcept = 0;
};

}  // namespace mpf
