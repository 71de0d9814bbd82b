// SPDX-License-Identifier: MIT
// SerialEnds: both ends of modelled serial ports: the instruments at their pseudo-terminals, and
// the client of their servers.
//
//   PortClients ─ "port0" ... ─ mpf-serial-server ─ model of an octal UART ─ pseudo-terminals ─ Instruments
//
// Threads  each the only one of its process.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <mpf/file_descriptor.h>
#include <mpf/message_client.h>

#include "benchmarks/hardware/hardware.h"

namespace mpf::bench {

inline constexpr int kPorts = 8;

class Instruments {
 public:
  // Waits until the server has said which terminals its ports have.
  //   throws  std::runtime_error when it does not, std::system_error
  explicit Instruments(const HardwareServers& servers);
  // Reads what comes, for ever, and sends it back if it is to echo.
  [[noreturn]] void play(bool echoes);

 private:
  std::vector<FileDescriptor> terminals_;
};

// They play as what a row calls its server, on the requester's CPU: they are the far end.
[[nodiscard]] std::function<void(const Scene&)> playInstruments(const Stage& stage,
                                                                const HardwareServers& servers,
                                                                bool echoes);

// A client of each of the first `ports` ports, with one request on its way.
class PortClients {
 public:
  // Called when a port's reply is there, and it may be asked again.
  //   isWhole  false: characters of the echo were lost
  using OnReply = std::function<void(std::size_t port, bool isWhole)>;

  //   characters  of a request, and of the answer that `awaitsEcho` asks for
  //   throws      std::runtime_error when a server does not come
  PortClients(const Bench& bench, int ports, std::size_t characters, bool awaitsEcho,
              OnReply onReply);
  void send(std::size_t port);
  // Throws std::runtime_error when a reply is not what it should be.
  void runOnce() { dispatcher_.runOnce(); }
  [[nodiscard]] std::size_t size() const noexcept { return clients_.size(); }
  // Of the answers since the last call.
  [[nodiscard]] LineFaultFigures takeFaults() noexcept;

 private:
  void ask(std::size_t port, std::int32_t command, std::size_t characters, int timeoutMs);
  void take(std::size_t port, const Message& message);
  void countFaults(const Char8Array& reply) noexcept;

  const std::size_t characters_;
  const bool awaitsEcho_;
  OnReply onReply_;
  std::array<bool, kPorts> settles_{};  // what comes late after a loss is waited for
  LineFaultFigures faults_{.shortAnswers = 0};
  Dispatcher dispatcher_;
  std::deque<MessageClient> clients_;
};

}  // namespace mpf::bench
