// SPDX-License-Identifier: MIT
// OctalUartModel: a model of an Octal 232, 422 or 485, with a far end at each of its eight ports.
//
//   const OctalUartModelOptions options{.terminals = true};
//   auto& uart = carrier.plug("IP_a", std::make_unique<OctalUartModel>(options));
//   uart.terminal(3);                   // "/dev/pts/7", which the program of an instrument opens
//
//   uart.farEndSend(3, "1.234\r");      // without terminals: the far end in memory
//   uart.waitUntilFarEndReceived(3, "MEAS?\r");
//
// A byte takes no time, and none is lost; or it takes the time of its baud rate, by the clock or in
// steps that a test makes.
//
// Threads  any number of callers at a time. The model has one thread of its own when it uses the
//          clock or terminals.
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
  instant,  // a byte takes no time
  clock,  // CLOCK_MONOTONIC
  stepped,  // only advance() lets time pass
};

struct OctalUartModelOptions {
  std::uint16_t model = 0x22;  // 0x2a: Octal 422, 0x48: Octal 485
  OctalUartModelTime time = OctalUartModelTime::instant;
  // A pseudo-terminal is the far end of each port; otherwise it is in memory.
  bool terminals = false;
};

class OctalUartModel final : public DeviceModel {
 public:
  //   throws  std::system_error when no pseudo-terminal, descriptor or thread can be created
  explicit OctalUartModel(const OctalUartModelOptions& options = {});
  ~OctalUartModel() override;

  std::uint16_t read(Space space, std::size_t offset, Lanes lanes) override;
  void write(Space space, std::size_t offset, std::uint16_t value, Lanes lanes) override;

  // --- the far ends
  // The path of a port's pseudo-terminal. When its buffer is full, further bytes are lost.
  [[nodiscard]] const std::string& terminal(int port) const {
    return terminals_.at(index(port)).path;
  }
  // The far end sends `text`. `fault` damages each byte of it.
  void farEndSend(int port, std::string_view text, LineFault fault = LineFault::none);
  // All bytes that the far end has received from the port.
  [[nodiscard]] std::string farEndReceived(int port) const;
  // Waits until these bytes end with `text`.
  void waitUntilFarEndReceived(int port, std::string_view text) const;
  // Sets the CTS input of the port.
  void setClearToSend(int port, bool clear);

  // Calls `look` with a channel, under the lock, and returns its result.
  template <class Look>
  auto with(int port, Look look) const {
    const std::lock_guard lock(mutex_);
    return look(std::as_const(channels_.at(index(port))));
  }
  [[nodiscard]] std::uint8_t vector() const;
  // The longest time, since the last call, for which a request line was active and no register of
  // its half of the chip was accessed. Only with OctalUartModelTime::clock.
  [[nodiscard]] std::chrono::nanoseconds takeLongestWait();
  // The number of write cycles.
  [[nodiscard]] std::uint64_t writes() const;
  // Resets the chip, as after a power failure.
  void reset();

  // --- time, when it is stepped
  void advance(std::chrono::nanoseconds time);
  // Waits until the chip has no request.
  void waitUntilServed() const;

 private:
  struct Terminal {
    std::string path;
    FileDescriptor master;
    // kept open, so that the master sees no hang-up when the program of an instrument closes it
    FileDescriptor slave;
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
  mutable std::mutex mutex_;  // guards the members below, except thread_
  mutable std::condition_variable changed_;
  std::array<OctalUartModelChannel, scc2698b::kChannels> channels_;
  std::array<std::uint8_t, scc2698b::kBlocks> imr_{};
  std::array<bool, 2> isActive_{};  // request lines
  // when the request line became active, or its half of the chip was accessed last
  std::array<std::int64_t, 2> waitsSinceNs_{};
  std::int64_t longestWaitNs_ = 0;
  std::uint8_t vector_ = 0x0f;
  std::uint64_t writes_ = 0;
  std::int64_t steppedNs_ = 0;
  std::jthread thread_;  // last: ends before the members that it uses
};

}  // namespace mpf
