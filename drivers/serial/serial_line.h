// SPDX-License-Identifier: MIT
// SerialLine: the part of a serial port that differs between kinds of line. PolledSerialPort is the
// common part, and calls it.
//
//            tryOpen()         tryRead() or tryWrite() reports the loss
//   closed ────────────► open ─────────────────────────────────────────► close()
//      └──► opening ──► tryOpen() again, each time that waitsFor() is ready
//
// Threads  the port's thread only. No function blocks.
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
  bool followsGap = false;  // bytes may be missing between the previous byte and this one

  friend bool operator==(const LineByte&, const LineByte&) = default;
};

// The most bytes that a line reads from the kernel with one call.
inline constexpr std::size_t kReadBytes = 4096;

class SerialLine {
 public:
  enum class OpenState : std::uint8_t { opening, open, failed };

  SerialLine() = default;
  SerialLine(const SerialLine&) = delete;
  SerialLine& operator=(const SerialLine&) = delete;
  virtual ~SerialLine() = default;

  // The device or the address, for messages to people.
  [[nodiscard]] virtual std::string description() const = 0;
  // The last failure: the call, the object and the reason.
  [[nodiscard]] virtual std::string problem() const = 0;

  // Begins or continues an attempt to open the line, and applies its settings.
  //   returns  opening: call again when waitsFor() is ready; failed: problem() says why
  [[nodiscard]] virtual OpenState tryOpen() = 0;
  // The longest time that an attempt may last.
  [[nodiscard]] virtual std::chrono::milliseconds openTimeout() const = 0;
  virtual void close() noexcept = 0;
  // What to poll: while opening, for the next tryOpen(); while open, for received bytes.
  [[nodiscard]] virtual pollfd waitsFor() const noexcept = 0;

  // Appends the bytes that have arrived. Returns false when the line is lost.
  [[nodiscard]] virtual bool tryRead(std::vector<LineByte>& bytes) = 0;
  // Sends as many bytes as the line accepts now.
  //   returns  their number; nullopt when the line is lost
  [[nodiscard]] virtual std::optional<std::size_t> tryWrite(
      std::span<const std::uint8_t> bytes) = 0;
  // The time until the line has sent all bytes that it has accepted, at most 20 ms; 0 when all are
  // sent, or the line cannot report it. Ask again after that time.
  [[nodiscard]] virtual std::chrono::milliseconds timeToSend() const { return {}; }
  // Discards the accepted bytes that are not sent yet, where the line can do so.
  virtual void discardUnsent() noexcept {}
  // Returns the number of received bytes that were lost since the last call. LineByte::followsGap
  // marks the places, as exactly as the line can tell them.
  [[nodiscard]] virtual std::uint64_t takeOverruns() noexcept { return 0; }

  // Changes the settings, all or none. Each later tryOpen() applies them again.
  //   returns  empty; or a sentence that names the value that this line does not accept
  [[nodiscard]] virtual std::string tryConfigure(const SerialSettings& settings) = 0;
  // Begins or ends the break state. Returns false when this line cannot do so.
  [[nodiscard]] virtual bool trySetBreak(bool on) noexcept = 0;
};

}  // namespace mpf
