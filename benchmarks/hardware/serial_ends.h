// SPDX-License-Identifier: MIT
// Both ends of modelled serial ports: the clients of their servers, and the instruments at their
// pseudo-terminals.
//
//   PortClients ─ mpf-serial-server ─ model of an octal UART ─ pseudo-terminals ─ Instruments
//
// Threads  one; each end runs in a process of its own.
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
  // Waits until the server has printed the terminals of its ports.
  //   throws  std::runtime_error when it does not, std::system_error
  explicit Instruments(const HardwareServers& servers);
  // Reads all input, without end, and sends it back if `echoes`.
  [[noreturn]] void play(bool echoes);

 private:
  std::vector<FileDescriptor> terminals_;
};

// The Workload::server of a row: runs the instruments, on the requester's CPU, because they are the
// remote ends of the lines.
[[nodiscard]] std::function<void(const RunContext&)> playInstruments(const Stage& stage,
                                                                     const HardwareServers& servers,
                                                                     bool echoes);

// A client of each of the first `ports` ports, with one outstanding request.
class PortClients {
 public:
  // Called when a reply has arrived and the next request may be sent to the port.
  //   isWhole  false: characters of the echo were lost
  using OnReply = std::function<void(std::size_t port, bool isWhole)>;

  //   characters  of a request, and of the answer that `awaitsEcho` asks for
  //   throws      std::runtime_error when a server is not connected in time
  PortClients(const Bench& bench, int ports, std::size_t characters, bool awaitsEcho,
              OnReply onReply);
  void send(std::size_t port);
  // Throws std::runtime_error for an unexpected reply.
  void runOnce() { dispatcher_.runOnce(); }
  [[nodiscard]] std::size_t size() const noexcept { return clients_.size(); }
  // Faults of the answers since the last call.
  [[nodiscard]] LineFaultFigures takeFaults() noexcept;

 private:
  void ask(std::size_t port, std::int32_t command, std::size_t characters, int timeoutMs);
  void take(std::size_t port, const Message& message);
  void countFaults(const Char8Array& reply) noexcept;

  const std::size_t characters_;
  const bool awaitsEcho_;
  OnReply onReply_;
  std::array<bool, kPorts> settles_{};  // after a loss: late characters are being read
  LineFaultFigures faults_{.shortAnswers = 0};
  Dispatcher dispatcher_;
  std::deque<MessageClient> clients_;
};

}  // namespace mpf::bench
