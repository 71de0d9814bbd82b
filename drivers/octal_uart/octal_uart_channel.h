// SPDX-License-Identifier: MIT
// OctalUartChannel: one serial channel of the chip, with a buffer for received bytes and a buffer
// for unsent bytes.
//
//   interrupt thread                          port's thread
//   chip ─── serve() ──► received bytes ──► take()
//   chip ◄── serve() ─── unsent bytes ◄──── put()
//
// The bell wakes the port's thread: when there are bytes to take, when put() has room again, when
// no byte is left to send, and when the channel is lost.
//
// RS-485: put() switches the transmitter on and the receiver off; tryTurn() does the reverse. So a
// port does not receive the bytes that it sends.
//
// Threads  the caller holds the lock of the chip (OctalUart). Any thread may poll the bell.
// Trust    a chip that always reports a byte costs a bounded time for each serve().
// Source   SCC2698B data sheet; order of commands as in tyGSOctal of drvIpac.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <vector>

#include <mpf/drivers/industry_pack/registers.h>
#include <mpf/file_descriptor.h>

#include "drivers/octal_uart/octal_uart_settings.h"
#include "drivers/octal_uart/scc2698b.h"
#include "drivers/serial/serial_line.h"

namespace mpf {

class OctalUartChannel {
 public:
  // Capacity of the buffer for received bytes: 17 s at 38400 baud. When it is full, further bytes
  // are lost, and counted as overruns.
  static constexpr std::size_t kMaxReceived = 65536;
  static constexpr std::size_t kMaxUnsent = 4096;

  //   imr     the value of the mask register of the block, which two channels share
  //   throws  std::system_error when no descriptor can be created
  OctalUartChannel(Registers& io, int number, bool isRs485, std::uint8_t& imr);

  // For poll(): readable when the bell was rung; take() resets it.
  [[nodiscard]] int bell() const noexcept { return bell_.get(); }
  [[nodiscard]] bool isOpen() const noexcept { return isOpen_; }
  // Why the channel was lost.
  [[nodiscard]] const std::string& lostBecause() const noexcept { return lostBecause_; }

  // Resets and enables the receiver and the transmitter.
  void open(const SerialSettings& settings);
  void configure(const SerialSettings& settings);
  // Disables both directions and their interrupts, also of a channel that was never open.
  void close();
  // Marks the channel as lost, because its module does not answer. Does not access the chip.
  void lose(const std::string& because);
  // Returns whether the chip still has the settings that were written to it; if not, it was reset.
  [[nodiscard]] bool isAsConfigured();

  // Reads all bytes that the chip has received, and writes unsent bytes.
  //   isr        the interrupt bits of this channel, at the positions of channel a
  //   isPresent  true when the chip is known to be present: then a status register of all ones is
  //              valid
  //   returns    false when the status register reads as all ones and isPresent is false: then call
  //              again after a check of the module
  [[nodiscard]] bool serve(std::uint8_t isr, bool isPresent);

  // Moves the received bytes to the end of `bytes`. LineByte::followsGap marks the byte after a
  // gap. After an overrun in the chip it marks two bytes, one of which follows the gap.
  void take(std::vector<LineByte>& bytes);
  // Returns the number of bytes lost since the last call.
  [[nodiscard]] std::uint64_t takeOverruns() noexcept;
  // Sends bytes, or keeps them to be sent. Returns the number of bytes that it had room for.
  [[nodiscard]] std::size_t put(std::span<const std::uint8_t> bytes);
  void discardUnsent();
  void setBreak(bool on);

  // The least time until all bytes are sent; 0 when they are. Never 0 for a lost channel, because
  // its bytes are never sent.
  [[nodiscard]] std::chrono::nanoseconds timeToSend();
  // RS-485: returns whether the transmitter is on and must be switched off. tryTurn() switches it
  // off when all bytes are sent.
  [[nodiscard]] bool waitsForTurn() const noexcept { return isTalking_ && !isBreaking_; }
  void tryTurn();

 private:
  [[nodiscard]] std::uint8_t read(scc2698b::ChannelRegister which) {
    return io_.read8(scc2698b::at(number_, which));
  }
  void write(scc2698b::ChannelRegister which, std::uint8_t value) {
    io_.write8(scc2698b::at(number_, which), value);
  }
  void command(unsigned value);
  void setMask(std::uint8_t bits, bool on);
  void talk();
  void receive(std::uint8_t sr);
  void noteOverrun();
  bool takeGap() noexcept;
  void noteEmpty(std::uint8_t sr) noexcept;
  std::uint8_t transmit(std::uint8_t sr, bool isPresent);
  [[nodiscard]] bool isAllOut() {
    return unsent_.empty() && (read(scc2698b::kSr) & scc2698b::kSrTxEmt) != 0;
  }
  void ring() const noexcept;

  Registers& io_;
  const int number_;
  const bool isRs485_;
  std::uint8_t& imr_;
  FileDescriptor bell_;  // eventfd
  bool isOpen_ = false;
  bool isTalking_ = false;
  bool isBreaking_ = false;
  bool lacksRoom_ = false;  // put() had no room for all bytes
  std::string lostBecause_;
  OctalUartMode mode_;
  std::chrono::nanoseconds byteTime_{};
  std::vector<LineByte> received_;
  std::deque<std::uint8_t> unsent_;
  std::uint64_t overruns_ = 0;
  // bit n: a gap may be before the byte that is read from the chip after n other bytes
  unsigned gaps_ = 0;
  // received_ was full: a gap is before the next byte that is put into it
  bool isCut_ = false;
};

}  // namespace mpf
