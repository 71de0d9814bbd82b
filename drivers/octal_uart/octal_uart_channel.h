// SPDX-License-Identifier: MIT
// OctalUartChannel: one of a chip's serial channels, between its registers and what a port has
// received and wants to send.
//
//   chip ── serve() ──► received ──► take()        port's thread
//   chip ◄── serve() ── unsent ◄──── put()         bell: rung when there is something to take, room to put, nothing
//                                                          left to send, or the line is lost
//
// RS-485: the transmitter is switched on by put() and off by tryTurn(), the receiver the other way
// round: who talks does not hear itself.
//
// Threads  none of its own: who calls holds the lock of the chip (OctalUart). The bell may be
//          polled by any.
// Trust    a chip that says for ever that it has a byte costs a bounded time per serve().
// Source   SCC2698B data sheet; order of commands as drvIpac's tyGSOctal has them.
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
  // As many bytes may wait for a port's thread: 17 s at 38400 baud. Further ones are lost, and
  // counted.
  static constexpr std::size_t kMaxReceived = 65536;
  static constexpr std::size_t kMaxUnsent = 4096;

  //   imr     what the mask register of its block holds, which its neighbour shares
  //   throws  std::system_error
  OctalUartChannel(Registers& io, int number, bool isRs485, std::uint8_t& imr);

  [[nodiscard]] int bell() const noexcept { return bell_.get(); }
  [[nodiscard]] bool isOpen() const noexcept { return isOpen_; }
  // Why it is not open any more.
  [[nodiscard]] const std::string& lostBecause() const noexcept { return lostBecause_; }

  // Resets both directions and enables them.
  void open(const SerialSettings& settings);
  void configure(const SerialSettings& settings);
  // Silences it, also when it was never open.
  void close();
  // Its module does not answer any more.
  void lose(const std::string& because);
  // The chip still has what was written to it; otherwise it has been reset.
  [[nodiscard]] bool isAsConfigured();

  // Takes all that the chip has received, and gives it what there is to send.
  //   isr      the bits of this channel, as those of channel a
  //   isThere  the chip is known to be there: a status of all ones is one
  //   returns  false at a status of all ones, otherwise: is it there?
  [[nodiscard]] bool serve(std::uint8_t isr, bool isThere);

  // What was received. A byte that follows a gap says so; after an overrun in the chip two bytes
  // may, of which one does.
  void take(std::vector<LineByte>& bytes);
  [[nodiscard]] std::uint64_t takeOverruns() noexcept;
  // Returns how many of `bytes` it had room for.
  [[nodiscard]] std::size_t put(std::span<const std::uint8_t> bytes);
  void discardUnsent();
  void setBreak(bool on);

  // How long until all is out, at least; 0 when it is. What a lost line had to send is never out.
  [[nodiscard]] std::chrono::nanoseconds timeToSend();
  // RS-485: whether the transmitter is on and to be switched off by tryTurn(), which does it when
  // all is out.
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
  std::uint8_t transmit(std::uint8_t sr, bool isThere);
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
  bool lacksRoom_ = false;  // put() could not take all
  std::string lostBecause_;
  OctalUartMode mode_;
  std::chrono::nanoseconds byteTime_{};
  std::vector<LineByte> received_;
  std::deque<std::uint8_t> unsent_;
  std::uint64_t overruns_ = 0;
  // bit n: bytes may be missing before the byte that is n bytes behind the next one in the chip
  unsigned gaps_ = 0;
  // received_ had no room: bytes are missing before the next one that goes into it
  bool isCut_ = false;
};

}  // namespace mpf
