// SPDX-License-Identifier: MIT
// LineReader: collects what a serial port receives into answers.
//
//   bytes ─► input, at most bufferBytes ─► first end of message, `extra` bytes, or overflow ─► answer
//
// Threads  the port calls byteReceived, readBegins and readEnds; the server's thread everything else. A mutex joins them.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>

#include <mpf/drivers/serial/serial_port.h>

namespace mpf {

class LineReader final : public ByteHandler {
 public:
  // `eom`: 0 to 2 bytes that end an answer. `circular`: keep what is received while nobody reads.
  LineReader(std::size_t bufferBytes, std::string eom, bool circular);

  void setEom(std::string eom);
  void setCircular(bool circular);
  // For the next read: drop what is there first; end after so many bytes, 0 for no such limit.
  void prepare(bool flush, std::size_t maxBytes);

  struct Answer {
    std::string bytes;
    bool overflow = false;
  };
  // Of the read that has ended.
  Answer takeAnswer();

  ByteHandlerResult byteReceived(std::uint8_t byte) override;
  ByteHandlerResult readBegins() override;
  void readEnds(SerialPortStatus status) override;

 private:
  // Length of the first complete answer in the input; 0 when there is none.
  [[nodiscard]] std::size_t completeBytes() const;

  std::mutex mutex_;
  std::size_t bufferBytes_;
  std::string eom_;
  bool circular_;
  bool flush_ = false;
  std::size_t maxBytes_ = 0;
  bool reading_ = false;
  std::string input_;
  Answer answer_;
};

}  // namespace mpf
