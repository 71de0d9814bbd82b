// SPDX-License-Identifier: MIT
// TcpLine: a TCP connection to a port of a terminal server as a SerialLine.
//
//   look up the name ──► connect to its first address ──► connected
//                          ├── refused: connect to its next address
//                          └── no answer: the next attempt begins with its next address
//
// Threads  the port's thread.
// Trust    a peer that vanishes without closing the connection is detected within about 30 s: by
//          TCP keepalive, or because it does not acknowledge sent bytes.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include <mpf/drivers/serial/tcp_address.h>
#include <mpf/file_descriptor.h>

#include "drivers/serial/name_lookup.h"
#include "drivers/serial/serial_line.h"

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
  std::vector<SocketAddress> untried_;  // the next address is the last element
  FileDescriptor socket_;
  bool isConnected_ = false;
};

}  // namespace mpf
