// SPDX-License-Identifier: MIT
// TcpLine: the line of a TcpSerialPort: a TCP connection to a port of a terminal server, in raw
// mode.
//
//   look the name up ──► connect to its first address ──► refused: the next one ──► connected
//                                        └── no answer: the next attempt goes on with the next one
//
// Threads  the port's thread.
// Trust    a peer that vanished without a word is noticed by keepalive, or by bytes that nobody
//          acknowledges, within half a minute.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include <mpf/file_descriptor.h>

#include "drivers/serial/name_lookup.h"
#include "drivers/serial/serial_line.h"
#include "drivers/serial/tcp_address.h"

namespace mpf {

class TcpLine : public SerialLine {
 public:
  TcpLine(TcpAddress address, std::chrono::milliseconds connectTimeout)
      : address_(std::move(address)), connectTimeout_(connectTimeout) {}

  [[nodiscard]] std::string description() const override { return address_.toString(); }
  [[nodiscard]] std::string problem() const override { return problem_; }
  [[nodiscard]] OpenState tryOpen() override;
  [[nodiscard]] std::chrono::milliseconds openTimeout() const override { return connectTimeout_; }
  void close() noexcept override;
  [[nodiscard]] pollfd waitsFor() const noexcept override;
  [[nodiscard]] bool tryRead(std::vector<LineByte>& bytes) override;
  [[nodiscard]] std::optional<std::size_t> tryWrite(std::span<const std::uint8_t> bytes) override;
  [[nodiscard]] std::string tryConfigure(const SerialSettings& settings) override;
  [[nodiscard]] bool trySetBreak(bool /*on*/) noexcept override { return false; }

 private:
  [[nodiscard]] OpenState beginLookup();
  [[nodiscard]] OpenState finishLookup(std::optional<NameLookup::Result> result);
  [[nodiscard]] OpenState connectNext();
  [[nodiscard]] OpenState finishConnect();
  void note(const char* call, int error);

  const TcpAddress address_;
  const std::chrono::milliseconds connectTimeout_;
  std::string problem_;
  std::optional<NameLookup> lookup_;
  std::vector<SocketAddress> untried_;  // addresses, the next one last
  FileDescriptor socket_;
  bool isConnected_ = false;
};

}  // namespace mpf
