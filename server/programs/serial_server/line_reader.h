// SPDX-License-Identifier: MIT
// LineReader: collects what a serial port receives into answers.
//
//   bytes ─► input, at most bufferBytes ─► first end of message, `extra` bytes, or overflow ─► answer
//   lost or damaged bytes ─► a mark in the input ─► the faults of each answer that spans it
//
// Threads  the port calls byteReceived, readBegins and readEnds; the server's thread everything else. A mutex joins them.
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <string>

#include <mpf/drivers/serial/serial_port.h>
#include <mpf/server/programs/serial_server/marked_input.h>

namespace mpf {

class LineReader final : public ByteHandler {
 public:
  // `eom`: 0 to 2 bytes that end an answer. `circular`: keep what is received while nobody reads.
  // `onFault`: called after each fault of the line, on the port's thread.
  LineReader(std::size_t bufferBytes, std::string eom, bool circular, std::function<void()> onFault = {});

  void setEom(std::string eom);
  void setCircular(bool circular);
  // For the next read: drop what is there first; end after so many bytes, 0 for no such limit.
  void prepare(bool flush, std::size_t maxBytes);

  struct Answer {
    std::string bytes;
    bool overflow = false;
    std::uint8_t faults = 0;  // bits of serial_server.h: bytes are missing or were damaged within it or right before it
  };
  // Of the read that has ended.
  Answer takeAnswer();

  ByteHandlerResult byteReceived(std::uint8_t byte) override;
  ByteHandlerResult readBegins() override;
  void readEnds(SerialPortStatus status) override;
  void lineFailed(LineFault fault, std::uint64_t count) override;

 private:
  // Length of the first complete answer in the input; 0 when there is none.
  [[nodiscard]] std::size_t completeBytes() const;

  const std::function<void()> onFault_;
  std::mutex mutex_;
  std::size_t bufferBytes_;
  std::string eom_;
  bool circular_;
  bool flush_ = false;
  std::size_t maxBytes_ = 0;
  bool reading_ = false;
  MarkedInput input_;
  Answer answer_;
};

}  // namespace mpf
