// SPDX-License-Identifier: MIT
// OctalUartModel: an Octal 232, 422 or 485 that is not there, with a line at each of its eight
// ports.
//
//   auto& uart = carrier.plug("IP_a",
//   std::make_unique<OctalUartModel>(OctalUartModelOptions{.terminals = true})); uart.terminal(3)
//   // /dev/pts/7: what an instrument's program opens
//
//   uart.say(3, "1.234\r");             // or without terminals: the far end in memory
//   uart.waitUntilHeard(3, "MEAS?\r");
//
// Time: bytes are instant, and none is ever lost; or take what the baud rate says, by the clock or
// by a test's hand.
//
// Threads  any; one of its own for the clock and terminals.
// Source   SCC2698B data sheet. Not modelled: counter, input pins, auto-echo, remote loopback.
#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

#include <mpf/drivers/industry_pack/device_model.h>
#include <mpf/file_descriptor.h>

#include "drivers/octal_uart/octal_uart_model_channel.h"
#include "drivers/octal_uart/scc2698b.h"

namespace mpf {

enum class OctalUartModelTime : std::uint8_t {
  instant,
  clock,
  stepped,  // advance() lets it pass
};

struct OctalUartModelOptions {
  std::uint16_t model = 0x22;  // 0x2a: Octal 422, 0x48: Octal 485
  OctalUartModelTime time = OctalUartModelTime::instant;
  bool terminals = false;  // behind each port a pseudo-terminal, instead of say() and heard()
};

class OctalUartModel final : public DeviceModel {
 public:
  // throws  std::system_error when there are no pseudo-terminals
  explicit OctalUartModel(const OctalUartModelOptions& options = {});
  ~OctalUartModel() override;

  std::uint16_t read(Space space, std::size_t offset, Lanes lanes) override;
  void write(Space space, std::size_t offset, std::uint16_t value, Lanes lanes) override;

  // --- the far ends
  // The path of a port's pseudo-terminal. Bytes that nobody reads there are lost when its buffer is
  // full.
  [[nodiscard]] const std::string& terminal(int port) const {
    return terminals_.at(index(port)).path;
  }
  // Sends `text`; what `fault` is not none damages each of its bytes.
  void say(int port, std::string_view text, LineFault fault = LineFault::none);
  // All that has come from that port.
  [[nodiscard]] std::string heard(int port) const;
  void waitUntilHeard(int port, std::string_view text) const;
  void setClearToSend(int port, bool clear);

  // A look at, or at any time a change of, a channel.
  template <class SnapshotDelta>
  auto with(int port, SnapshotDelta look) const {
    const std::lock_guard lock(mutex_);
    return look(std::as_const(channels_.at(index(port))));
  }
  [[nodiscard]] std::uint8_t vector() const;
  // The longest time that it asked for something and nobody touched that half of it, since the last
  // call; by the clock.
  [[nodiscard]] std::chrono::nanoseconds takeLongestWait();
  // How often something was written to it.
  [[nodiscard]] std::uint64_t writes() const;
  // The chip forgets all, as when its power fails.
  void reset();

  // --- time, when it is stepped
  void advance(std::chrono::nanoseconds time);
  // Waits until the chip asks for nothing.
  void waitUntilServed() const;

 private:
  struct Terminal {
    std::string path;
    FileDescriptor master;
    FileDescriptor slave;  // held open, or the master would see a hang-up when an instrument leaves
  };
  static std::size_t index(int port) noexcept { return static_cast<std::size_t>(port); }
  static Terminal openTerminal();
  std::uint8_t readRegister(std::size_t offset);
  void writeRegister(std::size_t offset, std::uint8_t value);
  std::uint8_t isrOfBlock(int block) const;
  [[nodiscard]] std::int64_t nowNs() const;
  void proceed();
  void noteAccess(std::size_t offset);
  void sendToTerminals();
  void followInterrupts();
  void run(const std::stop_token& stop);
  void readTerminals(std::span<const short> events);
  std::int64_t wakeAtNs();

  const OctalUartModelOptions options_;
  std::array<Terminal, scc2698b::kChannels> terminals_;
  FileDescriptor wakeUp_;
  mutable std::mutex mutex_;  // all below
  mutable std::condition_variable changed_;
  std::array<OctalUartModelChannel, scc2698b::kChannels> channels_;
  std::array<std::uint8_t, scc2698b::kBlocks> imr_{};
  std::array<bool, 2> isActive_{};  // request lines
  // of a line that is active: when it became so, or its half was touched
  std::array<std::int64_t, 2> waitsSinceNs_{};
  std::int64_t longestWaitNs_ = 0;
  std::uint8_t vector_ = 0x0f;
  std::uint64_t writes_ = 0;
  std::int64_t steppedNs_ = 0;
  std::jthread thread_;  // last: ends before what it uses
};

}  // namespace mpf
